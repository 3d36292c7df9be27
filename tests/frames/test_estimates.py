import numpy as np
import pytest

from gpca.errors import InputError
from gpca.frames.initial_pose import (
    EstimatorErrors,
    InitialPoseSettings,
    error_of,
    estimates_of,
    read_bop_results,
    read_pose_errors,
)

from .tiny import read

ERRORS = "scene_id,im_id,obj_id,estimator,rx,ry,rz,tx,ty,tz"
SEEN = {
    "points_m": np.array([[0.0, 0, 1], [0.01, 0, 1], [0, 0.01, 1]]),
    "pixels": np.array([[50, 50], [51, 50], [50, 51]]),
    "camera_3_3": np.array([[100.0, 0, 50], [0, 100, 50], [0, 0, 1]]),
    "diameter_m": 0.1,
}
HEAD = "scene_id,im_id,obj_id,score,R,t,time\n"
ONE = "1 0 0 0 1 0 0 0 1"


def pose(x_m, z_m=1.0):
    T = np.eye(4)
    T[:3, 3] = x_m, 0, z_m
    return T


def test_every_estimator_that_spoke_of_an_object_has_an_estimate():
    estimators = {"b": {(1, 2, 3): [pose(0.02)]}, "a": {(1, 2, 3): [pose(0.01)]}, "c": {}}
    found = estimates_of(estimators, (1, 2, 3), True, SEEN)
    assert [(name, T[0, 3]) for name, T in found] == [("a", 0.01), ("b", 0.02)]
    assert estimates_of(estimators, (1, 2, 4), True, SEEN) == []


def test_among_equal_objects_an_estimate_elsewhere_is_of_another_one():
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


def test_an_error_takes_the_true_pose_to_the_estimated_one():
    true, estimated = pose(0.1, 0.8), pose(0.3, 0.9)
    assert np.allclose(true @ error_of(true, estimated), estimated)


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


def results(tmp_path, *lines, head=HEAD):
    path = tmp_path / "results.csv"
    path.write_text(head + "\n".join(lines) + "\n")
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


DISTANCES_M, KNOWN = {(1, 0): [0.7, 0.8]}, {3}
FAULTS = {
    "no column R": ((f"1,0,3,0.2,{ONE}",), "scene_id,im_id,obj_id,score,t\n", "column 'R' is missing"),
    "eight entries": (("1,0,3,0.2,1 0 0 0 1 0 0 0,1 2 3,-1",), HEAD, "line 2: R has 8 entries, not 9"),
    "two entries": ((f"1,0,3,0.2,{ONE},1 2,-1",), HEAD, "line 2: t has 2 entries, not 3"),
    "words": ((f"1,0,3,0.2,{ONE},1 2 x,-1",), HEAD, "t contains values that are not finite numbers"),
    "a mirror": (
        ("1,0,3,0.2,1 0 0 0 1 0 0 0 -1,1 2 900,-1",),
        HEAD,
        "line 2: the pose is not a rigid transform: it is mirrored",
    ),
    "NaN": ((f"1,0,3,0.2,{ONE},1 2 nan,-1",), HEAD, "t contains values that are not finite"),
    "an image that is not there": (
        (f"1,0,3,1,{ONE},1 2 800,1", f"1,8,3,1,{ONE},1 2 800,1"),
        HEAD,
        "line 3: the dataset has no image 8",
    ),
    "no number": ((f"1,0,cup,1,{ONE},1 2 3,1",), HEAD, "line 2: obj_id is 'cup', not a whole number"),
    "no rows": ((), HEAD, "has no rows"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faulty_results_are_refused_in_one_line(tmp_path, fault):
    lines, head, expected = FAULTS[fault]
    with pytest.raises(InputError, match=expected) as caught:
        read_bop_results(results(tmp_path, *lines, head=head), DISTANCES_M, KNOWN)
    assert str(caught.value).startswith(str(tmp_path / "results.csv"))


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


def test_results_must_be_named_for_poses_to_come_from_them(scenes, tmp_path):
    with pytest.raises(InputError, match="dataset tiny: has no results file"):
        read(scenes, tmp_path / "objects.npz", InitialPoseSettings("results"))
