"""A user's clouds: read from files, and compared with the training data."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gpca import Explainer
from gpca.errors import InputError
from gpca.model.clouds import (
    MEASURES,
    Familiarity,
    hidden_share,
    measure,
    read_points,
    read_pose,
    read_target,
    voids_of,
)
from gpca.model.diagnosis import ADVICE, CHECK, UNKNOWN
from gpca.objects.canonical import canonical_cloud
from gpca.objects.procedural import FAMILIES, surfaces
from gpca.objects.sizes import AS_OPTIONS, require_sizes
from gpca.rigid import exp

trimesh = pytest.importorskip("trimesh")
POINTS = np.random.default_rng(0).uniform(size=(200, 3)) * [0.1, 0.2, 0.3]


def written(folder, name, points=POINTS):
    path = folder / name
    if name.endswith(".pcd"):
        head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        rows = "\n".join(" ".join(f"{x:.9g}" for x in point) for point in points)
        path.write_text(f"{head}WIDTH {len(points)}\nHEIGHT 1\nPOINTS {len(points)}\nDATA ascii\n{rows}\n")
    else:
        trimesh.PointCloud(points).export(path)
    return path


@pytest.mark.parametrize("name", ["cloud.ply", "cloud.pcd", "CLOUD.PLY"])
def test_a_cloud_keeps_its_points_in_its_unit(tmp_path, name):
    points, frame = read_target(written(tmp_path, name.lower()).rename(tmp_path / name))
    np.testing.assert_allclose(points, POINTS, atol=1e-7)
    in_mm, frame_mm = read_target(written(tmp_path, "mm.ply", 1e3 * POINTS))
    np.testing.assert_allclose(in_mm, 1e3 * POINTS, rtol=1e-6, atol=1e-4)
    assert frame_mm.diameter == pytest.approx(1e3 * frame.diameter)


@pytest.mark.parametrize("suffix", ["stl", "obj", "off", "ply", "glb"])
def test_a_mesh_is_sampled_in_its_own_frame_and_measured_by_its_vertices(tmp_path, suffix):
    box = trimesh.creation.box((30, 40, 120)).apply_translation((500, 0, 0))
    box.export(tmp_path / f"box.{suffix}")
    points, frame = read_target(tmp_path / f"box.{suffix}")
    assert len(points) > 10_000
    np.testing.assert_allclose(frame.center_3, (500, 0, 0), atol=1e-3)
    assert frame.diameter == pytest.approx(130)
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], box.bounds, atol=0.05)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda f: f / "lost.ply", "lost.ply: no such file; give one of .ply"),
        (lambda f: written(f, "few.ply", POINTS[:63]), "few.ply: has 63 points; give 64 or more"),
        (lambda f: written(f, "one.ply", POINTS[:1]), "one.ply: has 1 points"),
        (lambda f: written(f, "few.pcd", POINTS[:10]), "few.pcd: has 10 points"),
        (lambda f: written(f, "nan.pcd", np.nan * POINTS), "nan.pcd: all of its 200 points are NaN or infinite"),
        (lambda f: written(f, "zeros.ply", 0 * POINTS), r"zeros.ply: all of its 200 points are \(0, 0, 0\), as where"),
        (lambda f: written(f, "cloud.ply").rename(f / "cloud.abc"), "cloud.abc: has an unsupported format"),
    ],
)
def test_a_file_that_cannot_be_right_is_one_line(tmp_path, make, message):
    with pytest.raises(InputError, match=message):
        read_points(make(tmp_path))


@pytest.mark.parametrize("name", ["cloud.ply", "cloud.pcd"])
def test_rows_without_a_measurement_are_no_part_of_a_target(tmp_path, name):
    beside = np.full((60, 3), 0.0)
    beside[::2] = np.nan
    points, frame = read_target(written(tmp_path, name, np.r_[POINTS + 5, beside]))
    assert len(points) == 260  # they are kept, so that the explanation counts them
    np.testing.assert_allclose(frame.center_3, 5 + (POINTS.min(axis=0) + POINTS.max(axis=0)) / 2, atol=1e-6)


SIZES = [
    ((0.04, 43.0), ("m", "m"), "source: looks 1100 times smaller than the target; .* --source-unit m --unit mm"),
    ((0.04, 43.0), ("mm", "mm"), "source: looks 1100 times smaller than the target; .* --source-unit m --unit mm"),
    ((300.0, 0.3), ("m", "m"), "source: looks 1000 times larger than the target; .* --source-unit mm --unit m"),
    ((300.0, 300.0), ("m", "mm"), "source: looks 1000 times larger than the target; .* --source-unit mm --unit mm"),
    ((30.0, 0.3), ("m", "m"), "source: looks 100 times larger than the target; .* --source-unit cm --unit m"),
    ((300.0, 250.0), ("m", "m"), "target: its diameter is 250 m, but objects span 1 mm to 10 m; is it in millimeters"),
    ((0.3, 0.25), ("mm", "mm"), "target: its diameter is 0.00025 m, but .*; is it in meters. give --unit m; scans"),
    ((3e-4, 3.5e-4), ("m", "m"), "target: its diameter is 0.00035 m, but objects span 1 mm .*; scans .*: --scans$"),
    ((5.0, 0.4), ("m", "m"), "source: is 12.5 times as large as the target; give both in the same unit"),
    ((0.0, 0.4), ("m", "m"), "source: is 0 times as large as the target"),
    ((3e4, 2e4), ("m", "m"), "target: .* objects span 1 mm to 10 m; scans of any size: --scans$"),
]


@pytest.mark.parametrize(("extents", "units", "message"), SIZES)
def test_sizes_are_advised_by_the_units_that_were_given(extents, units, message):
    with pytest.raises(InputError, match=message):
        require_sizes(("source", "target"), extents, extents[1], units, AS_OPTIONS)


@pytest.mark.parametrize(("extents", "units"), [((0.04, 43.0), ("m", "mm")), ((0.3, 1.0), ("m", "m"))])
def test_sizes_that_fit_their_units(extents, units):
    require_sizes(("source", "target"), extents, extents[1], units, AS_OPTIONS)


@pytest.mark.parametrize("name", ["cloud.ply", "cloud.pcd", "box.stl", "box.obj", "box.ply"])
def test_a_cloud_or_mesh_that_an_offset_has_rounded_is_refused(tmp_path, name):
    if name.startswith("cloud"):
        path = written(tmp_path, name, (POINTS + 1e6).astype(np.float32))
    else:
        mesh = trimesh.creation.icosphere(2, radius=0.1)
        mesh.vertices = (mesh.vertices + 1e6).astype(np.float32).astype(float)
        mesh.export(path := tmp_path / name)
    with pytest.raises(InputError, match=rf"{name}: at coordinates of 1e\+06, float32 has steps of 0.062, .* subtract"):
        read_points(path)
    read_points(written(tmp_path, "near.ply", (POINTS + 1e3).astype(np.float32)))


T = exp(np.array([[0.1, 0.2, 0.3, 1.0, 2.0, 3.0]]))[0]
TUM = [*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_quat()]
POSES = {
    "rows.txt": lambda path: np.savetxt(path, T),
    "three_rows.txt": lambda path: np.savetxt(path, T[:3]),
    "commas.txt": lambda path: path.write_text(", ".join(map(str, T.ravel()))),
    "kitti.txt": lambda path: path.write_text(" ".join(map(str, T[:3].ravel())) + "\n"),
    "printed.txt": lambda path: path.write_text(f"# the result\n{T!r}".replace("array", "")),
    "json.txt": lambda path: path.write_text(json.dumps(T.tolist())),
    "tum.txt": lambda path: path.write_text(" ".join(map(str, TUM))),
    "with_time.txt": lambda path: path.write_text(
        "# time tx ty tz qx qy qz qw\n1305031102.1753 " + " ".join(map(str, TUM)) + "\n"
    ),
    "pose.npy": lambda path: np.save(path, T),
    "three_rows.npy": lambda path: np.save(path, T[:3]),
    "tum.npy": lambda path: np.save(path, TUM),
}


@pytest.mark.parametrize("name", POSES)
def test_a_pose_is_read_in_every_form(tmp_path, name):
    POSES[name](tmp_path / name)
    np.testing.assert_allclose(read_pose(tmp_path / name), T, atol=1e-6)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "no such file"),
        ("1 0 0", "contains 3 numbers; give 4×4 or 3×4 numbers"),
        ("one " * 16, "is not a number"),
        (" ".join(map(str, (2 * np.eye(4)).ravel())), "the pose is not a rigid transform"),
        (" ".join(map(str, np.diag([-1, 1, 1, 1]).ravel())), "the pose is not a rigid transform"),
        (" ".join(["nan"] * 16), "something that is not a number: 'nan' is not a finite"),
        (" ".join(map(str, np.eye(4).astype(int).ravel())).replace("1", "١"), "'١' is not a finite decimal number"),
        (" ".join(map(str, np.eye(4).astype(int).ravel())).replace(" 0", " 0_0"), "'0_0' is not a finite decimal"),
        (" ".join(map(str, (np.eye(4) + np.eye(4, k=3) * 1e16).ravel())), "the pose has a translation of 1e\\+16"),
        (" ".join(map(str, np.diag([1, 1, 1, 5]).ravel())), "the pose is not a rigid transform"),
        ("1 2 3 0 0 0 2", "qx qy qz qw, are no unit quaternion; give 4×4"),
        ("0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 1\n", "contains 16 numbers in lines of 8; give 4×4"),
        ("1 2 3 0 0 0 1\n1 2 3 0 0 0 1\n", "contains 14 numbers in lines of 7; give 4×4"),
        ("1 2 3 0\n0 0 1\n", "contains 7 numbers; give 4×4"),
        ("1 0 0 0 " * 6, "contains 24 numbers; give 4×4"),
    ],
)
def test_what_is_no_pose(tmp_path, text, message):
    if text is not None:
        (tmp_path / "pose.txt").write_text(text)
    with pytest.raises(InputError, match=message):
        read_pose(tmp_path / "pose.txt")


DIRECTIONS = np.random.default_rng(0).normal(size=(6, 3))
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)
FAR = np.array([[9.0, 0, 0]])
PAIRS = {
    "a source elsewhere": (lambda s, t: (s + 5, t), "no source point ended near the target", "the initial pose"),
    "a source 4 times as large": (lambda s, t: (4 * s, t), "source and target differ in scale", "unit and scale"),
    "a source 6.5 times as large": (lambda s, t: (6.5 * s, t), "source and target differ in scale", "unit and scale"),
    "a source a seventh as large": (lambda s, t: (s / 7, t), "source and target differ in scale", "unit and scale"),
    "a far point in both": (lambda s, t: (np.r_[s, FAR], np.r_[t, FAR]), "98% of the target's points", "points far"),
}


def halves(points, diameter_m):
    """A target, and a source that shares no point with it, in diameters."""
    points = np.random.default_rng(3).permutation(points.astype(float)) / diameter_m
    return points[:2000], points[2000:]


@pytest.fixture(scope="module")
def shapes(four):
    """Target and source of stand-ins by name, but for the scissors, too thin to have a back."""
    from gpca.objects.canonical import canonical_cloud

    made = {
        str(name): halves(four.points(i), diameter_m)
        for i, (name, diameter_m) in enumerate(zip(four.names, four.diameters_m, strict=True))
    }
    for surface in surfaces("linemod"):
        if surface.name in ("cat", "iron", "duck", "can"):
            points, _, diameter_m = canonical_cloud(surface, "linemod", 6000)
            made[surface.name] = halves(points, diameter_m)
    return {name: pair for name, pair in made.items() if "scissors" not in name}


UNSEEN = ("duck", "can")  # the others hold what a training should: an open vessel, a long thing, a flat one


@pytest.fixture(scope="module")
def clouds(shapes):
    return [pair for name, pair in shapes.items() if name not in UNSEEN]


@pytest.fixture(scope="module")
def unseen(shapes):
    return [shapes[name] for name in UNSEEN]


def visible(points, direction):
    """The points that a camera far away in that direction sees."""
    across = np.cross(direction, [0.3, 0.5, 0.8])
    picture = np.stack([points @ (across / np.linalg.norm(across)), points @ np.cross(direction, across)], axis=1)
    _, pixel = np.unique(np.floor(20 * picture).astype(int), axis=0, return_inverse=True)
    height = points @ direction
    foremost = np.full(pixel.max() + 1, -np.inf)
    np.maximum.at(foremost, pixel.ravel(), height)
    return points[height > foremost[pixel.ravel()] - 0.06]


def views(clouds):
    """What a camera sees of each object from each direction."""
    return [(visible(source, direction), target) for target, source in clouds for direction in DIRECTIONS]


def wholes(clouds):
    """Each object whole, and with a part cut off, noise added, or fewer points."""
    random, found = np.random.default_rng(1), []
    for target, source in clouds:
        along = source @ DIRECTIONS.T
        found += [(source[along[:, d] > np.quantile(along[:, d], q)], target) for d in range(6) for q in (0.1, 0.4)]
        noise = random.normal(size=source.shape)
        found += [(source, target), (source[:500], target), *((source + s * noise, target) for s in (0.01, 0.03))]
    return found


@pytest.fixture(scope="module")
def learnt(clouds):
    return {"views": Familiarity.of(views(clouds)), "wholes": Familiarity.of(wholes(clouds))}


def warned(familiarity, pairs):
    return [line for pair in pairs for lines in familiarity.warnings(*pair) for line in lines]


def test_half_of_a_sphere_is_hidden_and_little_of_one_side_of_it():
    sphere = np.random.default_rng(2).normal(size=(3000, 3))
    sphere /= 2 * np.linalg.norm(sphere, axis=1, keepdims=True)
    assert 0.35 < hidden_share(sphere) < 0.5
    assert hidden_share(sphere[sphere[:, 0] > 0]) < 0.2  # some of it only just faces the camera
    assert hidden_share(sphere * [1, 1, 0]) == 0
    measured = measure(0.5 * sphere, sphere)
    assert measured["size"] == pytest.approx(0.5)
    assert set(measured) == set(MEASURES)
    assert np.isnan(measure(sphere, sphere * [1, 1, 0])["depth"])


def test_good_input_of_shapes_that_were_not_learnt_raises_no_warning(learnt, unseen):
    assert warned(learnt["wholes"], wholes(unseen)) == []
    assert len(warned(learnt["views"], views(unseen))) <= 1  # of twelve, by as few as were learned


def test_whole_clouds_are_unlike_partial_views_and_the_other_way_round(learnt, clouds, unseen):
    for target, source in clouds + unseen:
        assert warned(learnt["views"], [(source, target)]) == [
            "the source shows the object from all sides; GP-CA was trained on partial views"
        ]
    said = warned(learnt["wholes"], views(clouds + unseen))
    assert sum("from one side alone" in line for line in said) >= 0.7 * 42


def test_a_target_of_one_side_is_not_the_whole_object(learnt, clouds, unseen):
    said = warned(learnt["wholes"], [(seen, seen) for seen, _ in views(clouds + unseen)])
    assert sum("give the whole object" in line for line in said) >= 0.9 * 42


@pytest.mark.parametrize("scale", [0.3, 2.0, 3.0])
def test_another_scale_is_noticed(learnt, clouds, scale):
    for target, source in clouds:
        [line] = [line for line in warned(learnt["wholes"], [(scale * source, target)]) if "same unit" in line]
        assert float(line.split()[3]) == pytest.approx(scale, rel=0.1)


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("threshold", [0.0, 2.0])  # of a model that calls everything failed, and nothing
def test_nothing_is_said_of_a_pair_without_meaning(name, threshold, model, pair):
    change, fault, check = PAIRS[name]
    levels = tuple(replace(level, threshold=threshold) for level in model.diagnoser.levels)
    diagnoser = replace(model.diagnoser, levels=levels)
    said = Explainer(replace(model, diagnoser=diagnoser), device="cpu").explain(*change(*pair))
    assert said.unknown
    assert (said.diagnosis.state, said.diagnosis.named, said.action) == (UNKNOWN, (), CHECK)
    assert check in said.reason
    assert any(line.startswith(fault) and "the scores are meaningless: check " in line for line in said.warnings)
    plain = json.loads(json.dumps(said.as_dict()))
    assert (plain["diagnosis"]["state"], plain["action"]) == ("unknown", "check")
    text = said.text()
    assert f"state     unknown\naction    {ADVICE[CHECK]}\nreason    the numbers mean nothing until " in text
    for word in ("nominal", "failed", "probability", "variance", "score "):
        assert word not in text


ANY_SIZE = Familiarity({"size": (0.0, np.inf)})


def test_what_can_be_judged_is_not_void(explainer, pair):
    source, target = pair
    for known in (source, 1.3 * source, source[: len(source) // 2], np.r_[source, [[0.3, 0, 0]]]):
        assert not explainer.explain(known, target).unknown
    near = source / np.linalg.norm(np.ptp(source, axis=0))
    (void,) = voids_of(near, near, 2 / len(near), ANY_SIZE)
    assert void.startswith("only 2 of the source's points ended near the target, so")
    assert voids_of(near, near, 3 / len(near), ANY_SIZE) == {}


@pytest.mark.parametrize("family", FAMILIES)
def test_the_diameter_of_no_object_is_made_up_of_a_few_points(family):
    for surface in surfaces(family):
        points, _, diameter_m = canonical_cloud(surface, family, 2048)
        assert voids_of(points / diameter_m, points / diameter_m, 1.0, ANY_SIZE) == {}
