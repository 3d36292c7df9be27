import numpy as np
import pytest

from gpca.alignment.rigid import rigid_motion
from gpca.frames.camera import Camera, MeshScene
from gpca.frames.shots import Shot
from gpca.recovery.reenactment import Appearance

CAMERA = Camera(80, 80, 80)
REACH_M = 0.01


def at(x_m, z_m):
    return rigid_motion(np.eye(3), (x_m, 0.0, z_m))


@pytest.fixture(scope="module")
def cube():
    import trimesh

    box = trimesh.creation.box((0.4, 0.4, 0.4))
    return MeshScene([(box.vertices, box.faces)])


def shot_of(cube, T_camera_object, hidden_to=0):
    """The cube before a wall at 3 m, its left columns behind something at 0.5 m; the camera is the world."""
    view = cube.look(CAMERA, np.linalg.inv(T_camera_object))
    is_object = np.isfinite(view.depth_m)
    depth_m = np.where(is_object, view.depth_m, 3.0)
    depth_m[:, :hidden_to], is_object[:, :hidden_to] = 0.5, False
    return Shot(CAMERA, np.eye(4), depth_m, is_object)


def test_the_true_pose_explains_all_and_others_the_less_the_farther_they_are(cube):
    appearance = Appearance([shot_of(cube, at(0, 1))], cube)
    shares = [appearance.explained(at(x_m, 1), REACH_M) for x_m in (0, 0.1, 0.2, 2)]
    assert shares[0] == 1
    assert shares == sorted(shares, reverse=True) and shares[-1] == 0
    assert appearance.explained(at(0, 1.1), REACH_M) == 0  # behind what was measured: it would be elsewhere
    assert appearance.explained(at(0, 1.1), 0.2) > 0.8


def test_what_stands_in_front_says_nothing(cube):
    appearance = Appearance([shot_of(cube, at(0, 1), hidden_to=40)], cube)
    assert appearance.explained(at(0, 1), REACH_M) == 1
    assert appearance.explained(at(0.2, 1), REACH_M) < 0.8  # there the camera looks through it at the wall


def test_all_shots_count(cube):
    right, wrong = shot_of(cube, at(0, 1)), shot_of(cube, at(0.3, 1))
    both = Appearance([right, wrong], cube).explained(at(0, 1), REACH_M)
    alone = (Appearance([shot], cube).explained(at(0, 1), REACH_M) for shot in (right, wrong))
    assert min(alone) < both < 1
