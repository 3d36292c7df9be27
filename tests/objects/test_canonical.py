import numpy as np
import pytest
import trimesh

from gpca.errors import InputError
from gpca.objects import canonical
from gpca.objects.canonical import (
    DRAWN,
    TRAINING,
    CanonicalFrame,
    ObjectClouds,
    canonical_cloud,
    diameter,
    drawn,
    read_scene_splits,
    thin,
    unseen,
    write_objects,
)
from gpca.objects.surface import Surface
from gpca.rigid import exp, transform


def box(name="box", extents=(0.1, 0.2, 0.3), shift=(1.0, 2.0, 3.0)):
    mesh = trimesh.creation.box(extents)
    return Surface(name, np.asarray(mesh.vertices) + shift, np.asarray(mesh.faces))


def view(name="view", points=400, depth_m=0.8):
    """A point cloud as a camera sees it: a bumpy patch in front of the origin."""
    xy = np.random.default_rng(0).uniform(-0.05, 0.05, (points, 2))
    return Surface(name, np.column_stack([xy, depth_m + 4 * (xy**2).sum(axis=1)]), None)


def test_mesh_is_centred_uniform_and_measured():
    points_m, normals, diameter_m = canonical_cloud(box(), "source", 20000)
    assert points_m.shape == normals.shape == (20000, 3)
    assert points_m.dtype == normals.dtype == np.float32
    assert diameter_m == pytest.approx(np.sqrt(0.1**2 + 0.2**2 + 0.3**2))
    half = np.array([0.05, 0.1, 0.15])
    assert np.abs(points_m).max(axis=0) == pytest.approx(half, abs=1e-6)
    # Each point lies on the face that its normal names, and each pair of faces has its share of the area.
    axis = np.abs(normals).argmax(axis=1)
    rows = np.arange(20000)
    assert points_m[rows, axis] * normals[rows, axis] == pytest.approx(half[axis], abs=1e-6)
    share = np.bincount(axis) / 20000
    assert share == pytest.approx(np.array([6, 3, 2]) / 11, abs=0.02)
    # In random order: the first tenth already covers all six faces.
    assert len({(a, s) for a, s in zip(axis[:2000], np.sign(normals[rows, axis])[:2000], strict=True)}) == 6


def test_points_on_a_mesh_are_those_that_trimesh_draws():
    torus = trimesh.creation.torus(0.1, 0.02)
    for seed in range(3):
        random, theirs = np.random.default_rng(seed), np.random.default_rng(seed)
        drawn = canonical.sample_surface(np.asarray(torus.vertices), np.asarray(torus.faces), 1000 + seed, random)
        for ours, expected in zip(drawn, trimesh.sample.sample_surface(torus, 1000 + seed, seed=theirs), strict=True):
            assert np.array_equal(ours, expected)


def test_a_draw_depends_on_names_and_used_vertices_alone():
    first = canonical_cloud(box(), "source", 100)[0]
    assert np.array_equal(first, canonical_cloud(box(), "source", 100)[0])
    assert not np.array_equal(first, canonical_cloud(box(), "other", 100)[0])
    assert not np.array_equal(first, canonical_cloud(box("box2"), "source", 100)[0])
    plain = box()
    stray = Surface("box", np.vstack([plain.vertices_m, [[9.0, 9.0, 9.0]]]), plain.faces)
    for expected, actual in zip(canonical_cloud(plain, "s", 64), canonical_cloud(stray, "s", 64), strict=True):
        assert np.array_equal(expected, actual)


def test_a_cloud_keeps_all_points_and_given_normals_or_looks_at_the_camera():
    surface = view()
    points_m, normals, diameter_m = canonical_cloud(surface, "source", 10)
    centre_m = (surface.vertices_m.min(axis=0) + surface.vertices_m.max(axis=0)) / 2
    back_m = points_m + centre_m
    order = np.lexsort(np.round(back_m, 5).T), np.lexsort(np.round(surface.vertices_m, 5).T)
    assert back_m[order[0]] == pytest.approx(surface.vertices_m[order[1]], abs=1e-6)
    assert not np.allclose(back_m, surface.vertices_m, atol=1e-4)  # shuffled
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1, abs=1e-5)
    assert (np.einsum("pc,pc->p", normals, back_m) < 0).all()
    assert 0.1 < diameter_m < 0.2
    given = surface.vertices_m / np.linalg.norm(surface.vertices_m, axis=1, keepdims=True)
    points_m, normals, _ = canonical_cloud(Surface("view", surface.vertices_m, None, given), "source")
    back_m = points_m + (surface.vertices_m.min(axis=0) + surface.vertices_m.max(axis=0)) / 2
    assert normals == pytest.approx(back_m / np.linalg.norm(back_m, axis=1, keepdims=True), abs=1e-5)


@pytest.mark.parametrize("flat", [False, True])
def test_diameter_agrees_with_all_pairs(flat):
    points = (
        np.random.default_rng(1).normal(size=(300, 3))
        * [1, 2, 0 if flat else 3]
        @ trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.5, 0.9]))[:3, :3]
    )
    assert diameter(points, "x") == pytest.approx(np.linalg.norm(points[:, None] - points[None], axis=2).max())


def scaled(factor):
    surface = box(shift=(0, 0, 0))
    return Surface("part", surface.vertices_m * factor, surface.faces)


FAULTS = {
    "no points": (Surface("part", np.zeros((0, 3)), None), "has no points"),
    "one point": (Surface("part", np.ones((1, 3)), None), "1 point"),
    "63 points": (Surface("part", view().vertices_m[:63], None), "64 or more"),
    "one line": (Surface("part", np.outer(np.linspace(0, 0.1, 80), [1, 2, 3]), None), "line"),
    "same point": (Surface("part", np.ones((80, 3)), None), "or lie on one line"),
    "nan": (Surface("part", np.vstack([[[0, np.nan, 0]], box().vertices_m[1:]]), box().faces), "NaN"),
    "zero area": (Surface("part", box().vertices_m * [1, 0, 0], box().faces), "no area"),
    "no faces": (Surface("part", box().vertices_m, np.zeros((0, 3), np.int64)), "no area"),
    "millimetres as metres": (scaled(1000), "set unit: mm"),
    "metres as millimetres": (scaled(0.001), "set unit: m"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_name_the_object_and_leave_no_file(fault, tmp_path):
    surface, message = FAULTS[fault]
    with pytest.raises(InputError, match=f"my_source: object 'part'.*{message}"):
        write_objects(iter([box(), surface]), "my_source", tmp_path / "objects.npz")
    assert list(tmp_path.iterdir()) == []


def test_duplicate_names_and_no_objects(tmp_path):
    with pytest.raises(InputError, match=r"object 'box'.*twice"):
        write_objects([box(), box(extents=(1, 1, 1))], "s", tmp_path / "o.npz")
    with pytest.raises(InputError, match="no object"):
        write_objects([], "s", tmp_path / "o.npz")


def test_written_objects_come_back(tmp_path, capsys):
    path = tmp_path / "run" / "objects.npz"
    surfaces = [box(), view(), box("large", (1, 1, 1))]
    write_objects(surfaces, "s", path, n_points=128)
    clouds = ObjectClouds.load(path)
    assert clouds.names.tolist() == ["box", "view", "large"]
    assert len(clouds) == 3
    for i, surface in enumerate(surfaces):
        points_m, normals, diameter_m = canonical_cloud(surface, "s", 128)
        assert np.array_equal(clouds.points(i), points_m)
        assert np.array_equal(clouds.normals_of(i), normals)
        assert clouds.diameters_m[i] == diameter_m
    assert "s: view: 400 points" in capsys.readouterr().err


def test_inconsistent_file_is_refused(tmp_path):
    path = tmp_path / "objects.npz"
    write_objects([box(), view()], "s", path, n_points=128)
    arrays = dict(np.load(path))
    for offsets in ([0, 128], [0, 128, 500], [0, 600, 528], [1, 128, 528]):
        np.savez(path, **{**arrays, "offsets": np.array(offsets)})
        with pytest.raises(InputError, match=r"do not match|fewer than 1|not 3"):
            ObjectClouds.load(path)
    with pytest.raises(InputError, match="no such file"):
        ObjectClouds.load(tmp_path / "other.npz")


def test_a_share_of_whole_clusters_at_least_one_and_never_all_is_unseen():
    clusters = np.array([f"part{i}" for i in range(10)])
    assert drawn(clusters, 0.2, "mine", 0).sum() == 2
    assert drawn(clusters[:3], 0.2, "mine", 0).sum() == 1
    assert drawn(clusters[:3], 0.9, "mine", 0).sum() == 2
    assert not drawn(clusters[:1], 0.5, "mine", 0).any()
    assert np.array_equal(drawn(clusters, 0.2, "mine", 0), drawn(clusters[::-1], 0.2, "mine", 0)[::-1])
    assert len({tuple(drawn(clusters, 0.2, "mine", seed)) for seed in range(5)}) > 1
    clusters = np.array(["cup", "box", "cup", "can", "box"])
    for seed in range(5):
        is_unseen = drawn(clusters, 0.4, "mine", seed)
        assert len(set(clusters[is_unseen])) == 1
        assert not set(clusters[is_unseen]) & set(clusters[~is_unseen])


def test_seeds_take_turns_with_folds_and_what_only_training_sees_is_never_unseen():
    folds = np.array([0, 3, TRAINING, 3, 0])
    assert [np.flatnonzero(unseen(folds, seed)).tolist() for seed in range(3)] == [[0, 4], [1, 3], [0, 4]]
    assert unseen(np.full(4, DRAWN), 0) is None
    assert unseen(np.array([1, 1, DRAWN]), 0) is None  # one fold: nothing would be left to train on


def test_a_scene_says_what_its_poses_are_worth(tmp_path):
    path = tmp_path / "scenes.csv"
    rows = "a,1,evaluation,0,icp,carried\na,2,evaluation,0,annotated,image\n"
    path.write_text(f"dataset,scene,role,fold,truth,estimates\n{rows}")
    places = read_scene_splits(path, "a")
    assert [place[3:] for place in places.values()] == [("icp", "carried"), ("annotated", "image")]
    path.write_text("dataset,scene,role,fold\na,1,evaluation,0\n")
    assert read_scene_splits(path, "a")[1][3:] == ("annotated", "image")
    path.write_text("dataset,scene,role,fold,truth\na,1,evaluation,0,guessed\n")
    with pytest.raises(InputError, match="scene 1 of a has 'guessed' as truth; choose one of annotated, icp"):
        read_scene_splits(path, "a")


CUBOID = np.random.default_rng(0).uniform((0, 0, 0), (0.3, 0.4, 1.2), size=(500, 3))
CUBOID[:2] = (0, 0, 0), (0.3, 0.4, 1.2)


def test_origin_and_unit_are_those_of_the_training_and_poses_outside_move_points_alike():
    frame = CanonicalFrame.of(CUBOID + 5)
    np.testing.assert_allclose(frame.center_3, 5 + np.array([0.15, 0.2, 0.6]))
    assert frame.diameter == pytest.approx(1.3)
    inside = frame.coordinates(CUBOID + 5)
    np.testing.assert_allclose(inside.min(axis=0), -inside.max(axis=0))
    assert np.linalg.norm(inside[0] - inside[1]) == pytest.approx(1)
    frame, T = CanonicalFrame(np.array([1.0, -2.0, 0.5]), 0.2), exp(np.array([[0.3, -0.2, 0.9, 0.1, 0.2, -0.4]]))[0]
    np.testing.assert_allclose(
        frame.coordinates(transform(frame.pose_outside(T), CUBOID)), transform(T, frame.coordinates(CUBOID))
    )


@pytest.mark.parametrize(
    ("points", "unit", "message"),
    [
        (CUBOID[:10], "m", "target: has 10 points; give 64 or more"),
        (np.where(np.arange(500)[:, None] == 7, np.nan, CUBOID), "m", "target: 1 of 500 points contain NaN"),
        (CUBOID * [1, 0, 0], "m", "all its points coincide or lie on one line"),
        (CUBOID * 1000, "m", "diameter is 1300 m, .*unit: mm"),
        (CUBOID * 1e-3, "mm", "diameter is 0.0000013 m, .*unit: m"),
        (CUBOID, "inch", "unit 'inch'"),
    ],
)
def test_points_that_span_no_frame(points, unit, message):
    with pytest.raises(InputError, match=message):
        CanonicalFrame.of(points, unit)


def test_a_huge_cloud_is_measured_by_some_of_its_points(monkeypatch):
    monkeypatch.setattr(canonical, "MEASURED_POINTS", 1000)
    sphere = np.random.default_rng(1).normal(size=(100_000, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    assert CanonicalFrame.of(sphere).diameter == pytest.approx(2, rel=5e-3)


def test_thinning_draws_points_once_each_and_the_same_every_time():
    few = thin(CUBOID, 100, "a")
    assert len(np.unique(few, axis=0)) == 100
    np.testing.assert_array_equal(few, thin(CUBOID, 100, "a"))
    assert not np.array_equal(few, thin(CUBOID, 100, "b"))
    assert thin(CUBOID, 500, "a") is CUBOID
