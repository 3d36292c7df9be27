import math

import numpy as np
import pytest
import trimesh
from scipy.spatial.distance import pdist

from gpca.errors import InputError
from gpca.objects import procedural

SHAPES = {family: procedural.FAMILIES[family]() for family in ("linemod", "ycb")}
# Of the google_16k scans, where they tell more than the extents.
YCB_DIAMETERS_MM = {"006_mustard_bottle": 197, "011_banana": 198, "025_mug": 125, "035_power_drill": 226}
YCB_DIAMETERS_MM |= {"037_scissors": 204, "051_large_clamp": 175, "052_extra_large_clamp": 217}


@pytest.fixture(scope="module")
def built():
    """The surfaces of every family."""
    return {family: list(procedural.surfaces(family)) for family in procedural.FAMILIES}


@pytest.fixture(scope="module")
def meshes(built):
    """The meshes of all objects by name, in meters."""
    return {surface.name: as_mesh(surface) for objects in built.values() for surface in objects}


def as_mesh(surface):
    return trimesh.Trimesh(surface.vertices_m, surface.faces, process=False)


def diameter_mm(mesh):
    return 1000 * pdist(mesh.convex_hull.vertices).max()


def common(mesh, solid):
    """The part of a mesh in meters that lies inside of a solid in millimeters."""
    return trimesh.boolean.intersection(
        [mesh, trimesh.Trimesh(procedural.mesh_of(solid)[0] / 1000, procedural.mesh_of(solid)[1])]
    )


@pytest.mark.parametrize("family", procedural.FAMILIES)
def test_every_object_is_one_closed_solid_of_a_table_top_s_size(built, family):
    objects = built[family]
    assert len({surface.name for surface in objects}) == len(objects) > 0
    for surface in objects:
        mesh = as_mesh(surface)
        assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0, surface.name
        assert mesh.body_count == 1, surface.name
        assert mesh.extents.min() > 0.008 and mesh.extents.max() < 0.4, (surface.name, mesh.extents)
        assert len(mesh.faces) < 25_000, surface.name
        assert surface.vertices_m.dtype == np.float64 and surface.faces.dtype == np.int64


@pytest.mark.parametrize("family", procedural.FAMILIES)
def test_building_twice_gives_identical_meshes(built, family):
    for first, second in zip(built[family], procedural.surfaces(family), strict=True):
        assert np.array_equal(first.vertices_m, second.vertices_m), first.name
        assert np.array_equal(first.faces, second.faces), first.name


def test_linemod_has_the_published_diameters_and_about_the_published_extents(meshes):
    for name, shape in SHAPES["linemod"].items():
        assert diameter_mm(meshes[name]) == pytest.approx(shape.diameter_mm, rel=0.01), name
        assert 1000 * meshes[name].extents == pytest.approx(np.array(shape.extents_mm), rel=0.11), name


def test_ycb_has_the_extents_and_diameters_of_the_scans(meshes):
    for name, shape in SHAPES["ycb"].items():
        if shape.extents_mm is not None:
            np.testing.assert_allclose(meshes[name].extents * 1000, shape.extents_mm, rtol=0.05, err_msg=name)
    for name, scan_mm in YCB_DIAMETERS_MM.items():
        assert diameter_mm(meshes[name]) == pytest.approx(scan_mm, rel=0.05), name


def test_names_are_those_of_the_benchmarks_in_order(built):
    assert [len(built[family]) for family in SHAPES] == [13, 21]
    for family, shapes in SHAPES.items():
        assert [surface.name for surface in built[family]] == sorted(shapes)


@pytest.mark.parametrize("name", ["024_bowl", "025_mug"])
def test_vessels_are_hollow_and_open_on_top(meshes, name):
    mesh = meshes[name]
    low, high = 1000 * mesh.bounds
    # The axis of the vessel is where its floor is: the mean of the points near the bottom.
    x, y = 1000 * mesh.triangles_center[mesh.triangles_center[:, 2] < low[2] / 1000 + 0.002][:, :2].mean(axis=0)
    core = common(mesh, procedural.cylinder(20, high[2] - low[2], (x, y, (low[2] + high[2]) / 2)))
    assert core.extents[2] < 0.006  # a floor, and nothing but air above it
    assert mesh.volume < 0.25 * mesh.convex_hull.volume


@pytest.mark.parametrize("name, loops", [("037_scissors", 2), ("051_large_clamp", 1), ("052_extra_large_clamp", 1)])
def test_finger_loops_and_jaws_are_through_holes(meshes, name, loops):
    assert meshes[name].euler_number <= 2 - 2 * loops


@pytest.mark.parametrize("name", procedural.CUPS)
def test_cups_are_hollow_open_at_the_top_and_can_be_held(meshes, name):
    mesh, cup = meshes[name], procedural.CUPS[name]
    assert mesh.volume < 0.4 * mesh.convex_hull.volume
    floor, top = cup.floor, cup.profile[-1][1] + 5
    inside = procedural.cylinder(10, top - floor - 0.3, (0, 0, (top + floor + 0.3) / 2))
    assert common(mesh, inside).is_empty
    disc = procedural.cylinder(10, 0.5 * floor, (0, 0, 0.65 * floor))
    assert common(mesh, disc).volume == pytest.approx(disc.volume() / 1e9)
    assert 1 - mesh.euler_number // 2 == cup.handles  # genus


def test_at_least_12_distinct_cups(built):
    objects = built["coffee_cup"]
    lengths_m = np.array([[*as_mesh(each).extents, as_mesh(each).volume ** (1 / 3)] for each in objects])
    assert len(objects) >= 12
    assert pdist(lengths_m).min() > 0.003


def test_unknown_family_is_refused_at_the_call():
    with pytest.raises(InputError, match=r"'teapots'.*coffee_cup, linemod, ycb"):
        procedural.surfaces("teapots")


def test_solids_have_the_volumes_of_the_textbook():
    assert procedural.box((1, 2, 3)).volume() == pytest.approx(6)
    assert procedural.cylinder(1, 2, axis="x").volume() == pytest.approx(2 * math.pi, rel=0.01)
    assert procedural.cylinder(2, 3, top=1).volume() == pytest.approx(7 * math.pi, rel=0.01)
    assert procedural.ellipsoid((1, 2, 3)).volume() == pytest.approx(8 * math.pi, rel=0.01)
    assert procedural.revolved([(2, 0), (3, 0), (3, 1), (2, 1)]).volume() == pytest.approx(
        2 * math.pi * 2.5, rel=0.01
    )  # Pappus
    capsule = procedural.tube([(0, 0, 0), (1, 2, 2)], 0.5).volume()
    assert capsule == pytest.approx(0.75 * math.pi + math.pi / 6, rel=0.03)
    assert procedural.slab((4, 3, 2), 1).volume() == pytest.approx(2 * (12 - (4 - math.pi)), rel=0.01)
    one, other = procedural.box((1, 1, 1)), procedural.box((1, 1, 1), (0.5, 0, 0))
    assert procedural.union(one, other).volume() == pytest.approx(1.5)
    assert procedural.hull(one, procedural.box((1, 1, 1), (2, 0, 0))).volume() == pytest.approx(3)
