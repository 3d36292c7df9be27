import numpy as np
import pytest

from gpca.alignment.rigid import transform
from gpca.frames.camera import Camera, MeshScene, look_at
from gpca.frames.shots import Shot, agreement, fuse, median_depth, without_outliers

from .tiny import CAMERA

D = 0.2


def ball(radius=0.1):
    import trimesh

    mesh = trimesh.creation.icosphere(3, radius)
    return mesh.vertices, mesh.faces, mesh.vertex_normals


def seen(eye, T_world_object=None, camera=CAMERA, before=()):
    """A perfect shot of a ball at a pose, with other meshes around."""
    vertices, faces, _ = ball()
    placed = vertices if T_world_object is None else transform(T_world_object, vertices)
    view = MeshScene([(placed, faces), *before]).look(camera, pose := look_at(np.array(eye, float), np.zeros(3)))
    return Shot(camera, pose, np.where(np.isfinite(view.depth_m), view.depth_m, 0.0), view.mesh == 0)


def test_points_lie_on_the_surface_and_two_views_are_fused_in_one_frame():
    shots = [seen((0.6, 0, 0.2)), seen((-0.6, 0, 0.2))]
    points = fuse(shots, 2 * D, filtered=False)
    assert np.linalg.norm(points, axis=1) == pytest.approx(0.1, abs=2e-3)
    assert points[:, 0].min() < -0.09
    assert points[:, 0].max() > 0.09
    assert shots[0].object_points_m(2 * D)[:, 0].min() > -0.05  # one view has no far side


def test_what_is_farther_than_a_diameter_from_the_median_is_left_out():
    shot = seen((0.6, 0, 0.2))
    depth_m = shot.depth_m.copy()
    v, u = np.argwhere(shot.mask)[0]
    depth_m[v, u] += 0.7
    assert len(Shot(CAMERA, shot.T_world_camera, depth_m, shot.mask).object_points_m(2 * D)) == shot.mask.sum() - 1


def test_projection_is_the_inverse_of_back_projection():
    shot = seen((0.6, 0.1, 0.2))
    points = shot.object_points_m(2 * D)
    v, u, depth_m = shot.project(points)
    assert (np.argwhere(shot.mask) == np.stack([v, u], axis=1)).all()
    assert depth_m == pytest.approx(shot.depth_m[v, u])
    assert [int(place[0]) for place in shot.project(np.array([[5.0, 0, 0]]))[:2]] == [-1, -1]  # behind the camera


def test_the_median_ignores_what_was_not_measured():
    frames = np.zeros((4, 1, 5))
    frames[:, 0, 0] = (1, 2, 3, 10)
    frames[:, 0, 1] = (0, 2, 3, 10)
    frames[:, 0, 2] = (0, 0, 3, 5)
    frames[:, 0, 3] = (0, 0, 0, 5)
    assert median_depth(frames)[0].tolist() == [2.5, 3, 4, 0, 0]


def test_outliers_go_and_the_surface_stays():
    points = fuse([seen((0.6, 0, 0.2))], 2 * D, filtered=False)
    stray = np.vstack([points, [[0, 0, 0.3], [0.3, 0.1, 0]]])
    kept = without_outliers(stray)
    assert np.linalg.norm(kept, axis=1).max() < 0.11
    assert len(kept) > 0.9 * len(points)


def test_the_true_pose_explains_the_shots_best():
    vertices, _, normals = ball()
    shots = [seen((0.6, 0, 0.2))]
    points = fuse(shots, 2 * D, filtered=False)

    def judged(shift):
        T = np.eye(4)
        T[:3, 3] = shift
        return sum(agreement(shots, points, vertices, normals, T, D)[:2])

    assert judged((0, 0, 0)) > 1.8
    assert judged((0, 0, 0)) > max(judged(shift) for shift in np.vstack([0.05 * np.eye(3), -0.05 * np.eye(3)]))


def test_surface_behind_something_measured_is_not_held_against_a_pose():
    import trimesh

    vertices, _, normals = ball()
    wall = trimesh.creation.box((0.01, 0.3, 0.3))
    wall.apply_translation((0.25, 0.15, 0))  # hides one half
    hidden = seen((0.6, 0, 0.0), before=[(wall.vertices, wall.faces)])
    assert 0.2 < hidden.mask.sum() / seen((0.6, 0, 0.0)).mask.sum() < 0.8
    points = fuse([hidden], 2 * D, filtered=False)
    on_model, explained, behind = agreement([hidden], points, vertices, normals, np.eye(4), D)
    assert on_model + explained > 1.8
    assert 0.2 < behind < 0.8


def test_a_camera_of_its_own_size_is_used():
    camera = Camera(40, 30, 40)
    shot = seen((0.6, 0, 0.2), camera=camera)
    assert shot.mask.shape == (30, 40)
    assert np.linalg.norm(shot.object_points_m(2 * D), axis=1) == pytest.approx(0.1, abs=6e-3)
