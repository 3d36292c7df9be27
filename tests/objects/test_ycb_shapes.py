import numpy as np
import pytest
import trimesh
from scipy.spatial.distance import pdist

from gpca.objects.shapes.solids import cylinder, intersection
from gpca.objects.shapes.ycb import OBJECTS

# Extents x, y, z in millimetres of the published google_16k scans in their tightest upright box (mug and pitcher:
# handle along x), rounded. The calliper table of Calli et al. 2015 is smaller (cracker box: 60 x 158 x 210).
PUBLISHED_MM = {
    "002_master_chef_can": (102, 102, 140),
    "003_cracker_box": (72, 164, 213),
    "004_sugar_box": (48, 93, 176),
    "005_tomato_soup_can": (68, 68, 102),
    "006_mustard_bottle": (96, 58, 191),
    "007_tuna_fish_can": (85, 85, 33.5),
    "008_pudding_box": (113, 90, 39),
    "009_gelatin_box": (73, 89, 30),
    "010_potted_meat_can": (101.5, 57, 83.5),
    "011_banana": (69, 198, 37),
    "019_pitcher_base": (189, 133, 242),
    "021_bleach_cleanser": (102, 68, 251),
    "024_bowl": (161, 161, 55),
    "025_mug": (117, 93, 81),
    "035_power_drill": (184, 187, 57),
    "036_wood_block": (90, 90, 206),
    "037_scissors": (88, 198, 15.7),
    "040_large_marker": (19, 121, 19),
    "051_large_clamp": (165, 121, 39),
    "052_extra_large_clamp": (202, 165, 36),
    "061_foam_brick": (52, 78, 51),
}
# Diameters of the google_16k scans in millimetres, for shapes whose extents say little about them.
DIAMETER_MM = {"006_mustard_bottle": 197, "011_banana": 198, "025_mug": 125, "035_power_drill": 226,
               "037_scissors": 204, "051_large_clamp": 175, "052_extra_large_clamp": 217}  # fmt: skip
HOLLOW = ("019_pitcher_base", "024_bowl", "025_mug")


@pytest.fixture(scope="module")
def meshes() -> dict[str, trimesh.Trimesh]:
    return {name: build() for name, build in OBJECTS.items()}


def test_names_are_those_of_ycb_video_in_order():
    assert list(OBJECTS) == sorted(PUBLISHED_MM)


@pytest.mark.parametrize("name", OBJECTS)
def test_is_one_watertight_solid(meshes, name):
    mesh = meshes[name]
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.volume > 0


@pytest.mark.parametrize("name", OBJECTS)
def test_extents_are_the_published_ones_in_metres(meshes, name):
    np.testing.assert_allclose(meshes[name].extents * 1000, PUBLISHED_MM[name], rtol=0.05)


@pytest.mark.parametrize("name", DIAMETER_MM)
def test_diameter_is_that_of_the_scan(meshes, name):
    diameter_mm = pdist(meshes[name].convex_hull.vertices).max() * 1000
    assert diameter_mm == pytest.approx(DIAMETER_MM[name], rel=0.05)


@pytest.mark.parametrize("name", HOLLOW)
def test_vessels_are_hollow_and_open_on_top(meshes, name):
    mesh = meshes[name]
    low, high = mesh.bounds
    # The axis of the vessel is where its floor is: the mean of the points near the bottom.
    x, y = mesh.triangles_center[mesh.triangles_center[:, 2] < low[2] + 0.002][:, :2].mean(axis=0)
    core = cylinder(0.02, high[2] - low[2], (x, y, (low[2] + high[2]) / 2))
    assert intersection(mesh, core).extents[2] < 0.006  # a floor, and nothing but air above it
    assert mesh.volume < 0.25 * mesh.convex_hull.volume


@pytest.mark.parametrize("name", ["037_scissors", "051_large_clamp", "052_extra_large_clamp"])
def test_finger_loops_and_jaws_are_through_holes(meshes, name):
    loops = 2 if name == "037_scissors" else 1
    assert meshes[name].euler_number <= 2 - 2 * loops


@pytest.mark.parametrize("name", OBJECTS)
def test_is_the_same_when_built_twice(meshes, name):
    again = OBJECTS[name]()
    np.testing.assert_array_equal(again.vertices, meshes[name].vertices)
    np.testing.assert_array_equal(again.faces, meshes[name].faces)
