import math

import numpy as np
import pytest
import trimesh
from scipy.spatial.distance import pdist

from gpca.errors import InputError
from gpca.objects import procedural

LINEMOD_MM = {  # extents x, y, z and diameter in models_info.json of BOP's lm
    "ape": (75.869, 77.599, 91.769, 102.099),
    "benchvise": (215.670, 121.856, 219.410, 247.506),
    "camera": (136.659, 143.030, 100.497, 172.492),
    "can": (100.792, 181.796, 193.734, 201.404),
    "cat": (67.011, 127.633, 117.457, 154.546),
    "driller": (229.476, 75.471, 208.002, 261.472),
    "duck": (104.429, 77.408, 85.697, 108.999),
    "eggbox": (150.185, 107.075, 69.241, 164.628),
    "glue": (36.721, 77.866, 172.816, 175.889),
    "holepuncher": (100.888, 108.497, 90.800, 145.543),
    "iron": (258.226, 118.482, 141.132, 278.078),
    "lamp": (203.146, 117.753, 213.116, 282.601),
    "phone": (93.918, 147.433, 184.747, 212.358),
}
# Extents of the google_16k scans in their tightest upright box, handles along x, and diameters where they tell more.
YCB_MM = {
    "002_master_chef_can": (102, 102, 140, None),
    "003_cracker_box": (72, 164, 213, None),
    "004_sugar_box": (48, 93, 176, None),
    "005_tomato_soup_can": (68, 68, 102, None),
    "006_mustard_bottle": (96, 58, 191, 197),
    "007_tuna_fish_can": (85, 85, 33.5, None),
    "008_pudding_box": (113, 90, 39, None),
    "009_gelatin_box": (73, 89, 30, None),
    "010_potted_meat_can": (101.5, 57, 83.5, None),
    "011_banana": (69, 198, 37, 198),
    "019_pitcher_base": (189, 133, 242, None),
    "021_bleach_cleanser": (102, 68, 251, None),
    "024_bowl": (161, 161, 55, None),
    "025_mug": (117, 93, 81, 125),
    "035_power_drill": (184, 187, 57, 226),
    "036_wood_block": (90, 90, 206, None),
    "037_scissors": (88, 198, 15.7, 204),
    "040_large_marker": (19, 121, 19, None),
    "051_large_clamp": (165, 121, 39, 175),
    "052_extra_large_clamp": (202, 165, 36, 217),
    "061_foam_brick": (52, 78, 51, None),
}
SCAN_DIAMETERS_MM = {name: diameter for name, (*_, diameter) in YCB_MM.items() if diameter}


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


@pytest.mark.parametrize("name", LINEMOD_MM)
def test_linemod_has_the_published_diameters_and_about_the_published_extents(meshes, name):
    *extents_mm, published_mm = LINEMOD_MM[name]
    assert diameter_mm(meshes[name]) == pytest.approx(published_mm, rel=0.01)
    assert 1000 * meshes[name].extents == pytest.approx(np.array(extents_mm), rel=0.11)


@pytest.mark.parametrize("name", YCB_MM)
def test_ycb_has_the_extents_of_the_scans(meshes, name):
    np.testing.assert_allclose(meshes[name].extents * 1000, YCB_MM[name][:3], rtol=0.05)


@pytest.mark.parametrize("name", SCAN_DIAMETERS_MM)
def test_ycb_has_the_diameters_of_the_scans(meshes, name):
    assert diameter_mm(meshes[name]) == pytest.approx(SCAN_DIAMETERS_MM[name], rel=0.05)


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
