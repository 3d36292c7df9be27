"""Results files that no estimator meant."""

import json

import numpy as np
import pytest

from gpca.alignment.pose_error import pose_error
from gpca.errors import InputError
from gpca.frames.initial_pose import (
    EstimatorErrors,
    GlobalRegistration,
    InitialPoseSettings,
    displace,
    estimates_of,
    read_bop_results,
    read_pose_errors,
)
from gpca.rigid import inverse, rotation_angle_rad

from ..hostile import refusal
from ..steps.by_words import main
from .damage import instances
from .tiny import read


def test_an_error_is_within_its_declared_size():
    T = np.eye(4)
    T[:3, 3] = (0.1, 0.2, 0.9)
    settings = InitialPoseSettings("true_pose", rotation_deg=5.0, translation=0.03)
    errors = [inverse(T) @ displace(T, 0.2, settings, np.random.default_rng(seed)) for seed in range(100)]
    angles_deg = np.rad2deg([rotation_angle_rad(error) for error in errors])
    shifts_m = np.linalg.norm([error[:3, 3] for error in errors], axis=1)
    assert 4.5 < angles_deg.max() <= 5.0
    assert 0.005 < shifts_m.max() <= 0.03 * 0.2
    assert angles_deg.min() < 0.5


def test_features_find_an_object_that_has_no_symmetry(tiny):
    instances, objects = tiny
    index = objects.row("tiny bracket")
    diameter_m = objects.diameters_m[index]
    registration = GlobalRegistration(objects, index, InitialPoseSettings(tries=10))
    rows = np.flatnonzero(instances.object_index == index)
    rows = rows[np.argsort(-np.diff(instances.offsets)[rows])][:2]  # the best seen
    found = [registration.register(instances.cloud_m(i), seed=1) for i in rows]
    errors = [
        pose_error(objects.points(index), T, instances.T_camera_object_true[i], False) / diameter_m
        for T, i in zip(found, rows, strict=True)
    ]
    assert min(errors) < 0.1
    assert np.array_equal(found[0], registration.register(instances.cloud_m(rows[0]), seed=1))


ERRORS = "scene_id,im_id,obj_id,estimator,rx,ry,rz,tx,ty,tz"
SEEN = {
    "points_m": np.array([[0.0, 0, 1], [0.01, 0, 1], [0, 0.01, 1]]),
    "pixels": np.array([[50, 50], [51, 50], [50, 51]]),
    "camera_3_3": np.array([[100.0, 0, 50], [0, 100, 50], [0, 0, 1]]),
    "diameter_m": 0.1,
}
HEAD = "scene_id,im_id,obj_id,score,R,t,time"
ONE = "1 0 0 0 1 0 0 0 1"


def pose(x_m, z_m=1.0):
    T = np.eye(4)
    T[:3, 3] = x_m, 0, z_m
    return T


def test_every_estimator_that_spoke_has_an_estimate_but_elsewhere_it_is_of_another_equal_object():
    estimators = {"b": {(1, 2, 3): [pose(0.02)]}, "a": {(1, 2, 3): [pose(0.01)]}, "c": {}}
    found = estimates_of(estimators, (1, 2, 3), True, SEEN)
    assert [(name, T[0, 3]) for name, T in found] == [("a", 0.01), ("b", 0.02)]
    assert estimates_of(estimators, (1, 2, 4), True, SEEN) == []
    estimators = {"a": {(1, 2, 3): [pose(0.3)]}}
    assert estimates_of(estimators, (1, 2, 3), False, SEEN) == []
    assert estimates_of(estimators, (1, 2, 3), True, SEEN)  # the only one of its kind: a bad estimate is one too


def test_errors_are_those_of_the_object_or_of_others_without_symmetry():
    errors = EstimatorErrors(symmetric={("a", 2)})
    for object_, x_m in ((("a", 1), 0.1), (("a", 2), 0.2), (("b", 1), 0.3)):
        errors.add(object_, pose(x_m))
    random = np.random.default_rng(0)

    def drawn(object_):
        return {errors.draw(object_, random)[0, 3] for _ in range(30)}

    assert drawn(("a", 2)) == {0.2}
    assert drawn(("b", 7)) == {0.1, 0.3}
    with pytest.raises(InputError, match="no estimator has a result for an object without symmetry"):
        EstimatorErrors(symmetric=()).draw(("a", 1), random)


def test_a_file_of_errors_is_read_in_metres_and_of_known_objects(tmp_path):
    path = tmp_path / "errors.csv"
    path.write_text(f"{ERRORS}\n48,1,1,x,0,0,{np.pi / 2},1.5,0,-20\n48,1,9,x,0,0,0,0,0,0\n")
    [(number, T)] = read_pose_errors(path, [1])
    assert number == 1
    assert np.allclose(T[:3, 3], [0.0015, 0, -0.02])
    assert np.allclose(T[:3, 0], [0, 1, 0])


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        ("48,1,1.5,x,0,0,0,0,0,0", "'obj_id' contains values that are not whole numbers"),
        ("48,1,1,x,0,0,180,0,0,0", "contains a rotation of more than half a turn; give rotation vectors in radians"),
        ("48,1,1,x,0,0,0,0,0,1e9", "contains an error of more than 10 m; give translations in millimeters"),
        ("48,1,1,x,0,nan,0,0,0,0", "column 'ry' contains values that are not finite numbers"),
    ],
)
def test_a_faulty_file_of_errors_is_refused(tmp_path, row, expected):
    path = tmp_path / "errors.csv"
    path.write_text(f"{ERRORS}\n{row}\n")
    with pytest.raises(InputError, match=expected):
        read_pose_errors(path, [1])


def results(tmp_path, *lines):
    path = tmp_path / "results.csv"
    path.write_text("\n".join([HEAD, *lines, ""]))
    return path


def test_results_are_read_best_first_row_by_row_and_in_metres(tmp_path):
    quarter = "0 -1 0 1 0 0 0 0 1"
    path = results(
        tmp_path, f"1,0,3,0.2,{ONE},100 200 300,-1", f"1,0,3,0.9,{quarter},1 2 3,-1", f"2,5,4,1,{ONE},0 0 9,0.1"
    )
    found = read_bop_results(path, {(1, 0): [0.3], (2, 5): []}, {3, 4})
    assert set(found) == {(1, 0, 3), (2, 5, 4)}
    best, second = found[1, 0, 3]
    assert best[:3, 3].tolist() == [0.001, 0.002, 0.003]
    assert (best[:3, :3] @ [1, 0, 0]).tolist() == [0, 1, 0]
    assert second[:3, 3].tolist() == [0.1, 0.2, 0.3]


def test_of_several_equal_objects_the_one_seen_in_the_mask_is_meant():
    camera_3_3 = np.array([[100.0, 0, 50], [0, 100, 50], [0, 0, 1]])
    poses = [np.eye(4), np.eye(4)]
    poses[0][:3, 3], poses[1][:3, 3] = (0.2, 0, 1), (-0.2, 0, 1)
    seen = {"pixels": np.array([[29, 50], [33, 52]]), "camera_3_3": camera_3_3, "points_m": np.zeros((3, 3))}
    [(name, pose)] = estimates_of({"mine": {(0, 0, 1): poses}}, (0, 0, 1), True, seen)
    assert name == "mine" and pose is poses[1]


def test_instances_start_from_the_results_and_without_any_from_an_error_of_these(scenes, tiny, tmp_path):
    instances, objects = tiny
    lines = []
    for i in range(0, len(instances), 2):  # of every other instance; objects are centred, so models' poses are theirs
        T, name = instances.T_camera_object_true[i], objects.names[instances.object_index[i]]
        number = ["brick", "cylinder", "cone", "capsule", "bracket"].index(name.removeprefix("tiny ")) + 1
        R, t = " ".join(map(str, T[:3, :3].ravel())), " ".join(map(str, 1e3 * T[:3, 3] + 1.0))
        lines.append(f"{instances.scene[i]},{instances.image[i]},{number},1.0,{R},{t},-1")
    path = results(tmp_path, *lines)
    found, _ = read(scenes, tmp_path / "objects.npz", InitialPoseSettings("results"), path)
    assert len(found) == len(instances)
    assert (found.init_from == np.where(np.arange(len(found)) % 2 == 0, "results", "errors")).all()
    errors_m = (found.T_camera_object_init - found.T_camera_object_true)[:, :3, 3]
    assert np.allclose(errors_m[::2], 1e-3, atol=1e-6)
    assert np.allclose(np.linalg.norm(errors_m, axis=1), np.sqrt(3) * 1e-3, atol=1e-6)


@pytest.fixture(scope="module")
def lines(scenes):
    """The true poses of the tiny dataset as an estimator would write them."""
    found = []
    for path in sorted(scenes.rglob("scene_gt.json")):
        for image, entries in json.loads(path.read_text()).items():
            for entry in entries:
                R, t = (" ".join(map(repr, entry[key])) for key in ("cam_R_m2c", "cam_t_m2c"))
                found.append([str(int(path.parent.name)), image, str(entry["obj_id"]), "1.0", R, t, "-1"])
    return found


@pytest.fixture
def call(damaged, lines):
    """Return a function that damages the results file and the arguments that read it."""

    def write(change=None, content=None, head=HEAD):
        rows = [list(line) for line in lines]
        if change:
            change(rows)
        text = "\n".join([head, *(",".join(row) for row in rows)]) + "\n" if content is None else content
        encoded = text if isinstance(text, bytes) else text.encode()
        (damaged.parent / "results.csv").write_bytes(encoded)
        entry = {"location": "tiny", "results": "results.csv"}
        given = {"initial_pose": {"form": "results"}, "datasets": {"tiny": entry}}
        return [*instances(given, scenes=None), "--data-dir", str(damaged.parent)]

    return write


def one(column, value):
    def change(rows):
        rows[2][column] = value

    return change


def scaled(factor, only=slice(None)):
    def change(rows):
        for row in rows[only]:
            row[5] = " ".join(repr(factor * float(value)) for value in row[5].split())

    return change


ROWS = {
    "t in metres": (scaled(1e-3), "give it in millimeters"),
    "one t in metres": (scaled(1e-3, slice(3, 4)), "line 5: t is"),
    "t behind": (scaled(-1), "line 2: t has z = -"),
    "R a quaternion": (one(4, "1 0 0 0"), "line 4: R has 4 entries, not 9"),
    "score with NUL": (one(3, "1\0"), "line 4: column 'score' contains a line break or another control"),
    "object unknown": (one(2, "77"), "line 4: the dataset has no object 77"),
    "image unknown": (one(1, "999"), "line 4: the dataset has no image 999"),
    "a row too short": (lambda rows: rows[2].__delitem__(slice(3, None)), "line 4: score has 0 entries"),
    "no rows": (lambda rows: rows.clear(), "has no rows"),
}


HEADS = {
    "column missing": (HEAD.replace("score", "confidence"), "column 'score' is missing"),
    "column twice": (HEAD.replace("time", "t"), "column 't' appears twice"),
    "no head": ("1,0,1,1.0,1 0 0 0 1 0 0 0 1,0 0 700,-1", "column 'scene_id' is missing"),
}

FILES = {"empty": (b"", "is empty"), "UTF-16": (HEAD.encode("utf-16"), "is not a readable CSV file")}


@pytest.mark.parametrize(
    ("part", "name"),
    [(part, name) for part, of in (("change", ROWS), ("head", HEADS), ("content", FILES)) for name in of],
)
def test_a_results_file_that_cannot_be(call, damaged, part, name):
    spoilt, words = {"change": ROWS, "head": HEADS, "content": FILES}[part][name]
    refusal(call(**{part: spoilt}), damaged.parent, "results.csv", words, ";")


def test_good_results_are_read(call, damaged, lines, capsys):
    from gpca.frames.instances import Instances

    def add(rows):
        rows += [[*row[:3], "-0.5", "1 0 0 0 1 0 0 0 1", "1e2 -2.5E1 2000.", ""] for row in rows[:2]]  # a bad guess

    outputs = {name: str(damaged.parent / name) for name in ("instances.npz", "objects.npz")}
    assert main([outputs.get(argument, argument) for argument in call(add)]) == 0
    read = Instances.load(outputs["instances.npz"])
    assert np.allclose(read.T_camera_object_init, read.T_camera_object_true, atol=1e-9)
    assert len(read) + capsys.readouterr().err.count("skipped") == len(lines)
