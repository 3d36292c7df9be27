import numpy as np
import pytest
import trimesh

from gpca.frames.shots import (
    VOXEL_M,
    Shot,
    Sighting,
    agreement,
    best_viewpoint,
    candidates,
    expected_surface,
    fuse,
    median_depth,
    occupy,
)
from gpca.objects.camera import Camera, MeshScene, look_at
from gpca.rigid import transform

from .tiny import CAMERA


def test_pixels_are_found_wherever_they_are_and_no_others():
    seen = Sighting(np.zeros((1, 3)), np.array([[3, 4], [0, 0], [639, 479]], np.int32), np.eye(3))
    asked = np.array([[3, 4], [4, 3], [0, 0], [-1, 479], [639, 479], [638, 2**20]])
    assert seen.measured(asked).tolist() == [True, False, True, False, True, False]


D = 0.2


def ball(radius=0.1):
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


def test_what_is_farther_than_a_diameter_and_outliers_go_and_the_surface_stays():
    shot = seen((0.6, 0, 0.2))
    depth_m = shot.depth_m.copy()
    v, u = np.argwhere(shot.mask)[0]
    depth_m[v, u] += 0.7
    assert len(Shot(CAMERA, shot.T_world_camera, depth_m, shot.mask).object_points_m(2 * D)) == shot.mask.sum() - 1
    depth_m = shot.depth_m.copy()
    v, u = np.argwhere(shot.mask)[:2].T
    depth_m[v, u] -= 0.25
    points = fuse([shot], 2 * D, filtered=False)
    kept = fuse([Shot(shot.camera, shot.T_world_camera, depth_m, shot.mask)], 2 * D, filtered=True)
    assert np.linalg.norm(kept, axis=1).max() < 0.11
    assert len(kept) > 0.9 * len(points)


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
    vertices, _, normals = ball()
    wall = trimesh.creation.box((0.01, 0.3, 0.3))
    wall.apply_translation((0.25, 0.15, 0))  # hides one half
    hidden = seen((0.6, 0, 0.0), before=[(wall.vertices, wall.faces)])
    assert 0.2 < hidden.mask.sum() / seen((0.6, 0, 0.0)).mask.sum() < 0.8
    points = fuse([hidden], 2 * D, filtered=False)
    on_model, explained, behind = agreement([hidden], points, vertices, normals, np.eye(4), D)
    assert on_model + explained > 1.8
    assert 0.2 < behind < 0.8


CAMERA = Camera(192, 144, 180)
CENTRE = np.array([0.1, -0.05, 0.06])


def box():
    mesh = trimesh.creation.box((0.08, 0.08, 0.10))
    points, faces = trimesh.sample.sample_surface(mesh, 400, seed=0)
    return mesh.vertices, mesh.faces, points, mesh.face_normals[faces]


def placed():
    T = np.eye(4)
    T[:3, 3] = CENTRE
    return T


def empty(T_world_camera):
    """A shot in which nothing of the object, nor anything else, was measured."""
    shape = (CAMERA.height, CAMERA.width)
    return Shot(CAMERA, T_world_camera, np.zeros(shape), np.zeros(shape, bool))


def test_candidates_stand_on_a_hemisphere_and_look_at_its_middle():
    poses = candidates(CENTRE, 0.7, 8, (20.0, 60.0))
    assert poses.shape == (16, 4, 4)
    away = poses[:, :3, 3] - CENTRE
    assert np.linalg.norm(away, axis=1) == pytest.approx(0.7)
    assert np.rad2deg(np.arcsin(away[:, 2] / 0.7)) == pytest.approx(np.repeat([20, 60], 8))
    assert np.einsum("ni,ni->n", poses[:, :3, 2], -away / 0.7) == pytest.approx(1)


def test_a_viewpoint_shows_the_sides_that_face_it():
    vertices, faces, points, normals = box()
    poses = candidates(CENTRE, 0.7, 4, (20.0,))
    seen, shown = expected_surface([empty(poses[0])], vertices, faces, points, placed(), 0.15, poses, CAMERA)
    assert not seen.any()
    for pose, of_view in zip(poses, shown, strict=True):
        facing = normals @ (pose[:3, 3] - CENTRE) > 0.15
        away = normals @ (pose[:3, 3] - CENTRE) < -0.15
        assert of_view[facing].mean() > 0.8
        assert of_view[away].mean() < 0.05  # points at an edge are within reach of the next side


def test_what_was_measured_elsewhere_hides_what_is_behind_it():
    vertices, faces, points, _ = box()
    poses = candidates(CENTRE, 0.7, 4, (20.0,))
    # Seen from above, a wall stands between the object and the first candidate.
    above = candidates(CENTRE, 0.7, 1, (85.0,))[0]
    y, z = np.meshgrid(np.linspace(-0.3, 0.3, 101), np.linspace(0.02, 0.5, 81))
    wall = np.stack([np.full(y.size, CENTRE[0] + 0.2), y.ravel(), z.ravel()], axis=1)

    class Measured(Shot):
        def other_points_m(self):
            return wall

    shot = Measured(CAMERA, above, np.zeros((144, 192)), np.zeros((144, 192), bool))
    _, free = expected_surface([empty(above)], vertices, faces, points, placed(), 0.15, poses, CAMERA)
    _, shown = expected_surface([shot], vertices, faces, points, placed(), 0.15, poses, CAMERA)
    assert free[0].sum() > 50
    assert shown[0].sum() == 0
    assert (shown[2] == free[2]).all()


def test_the_best_viewpoint_adds_most_to_what_was_seen():
    seen = np.array([True, True, True, False, False, False])
    shown = np.array([[1, 1, 1, 1, 0, 0], [0, 0, 0, 1, 1, 0], [1, 0, 0, 1, 1, 0]], bool)
    assert best_viewpoint(seen, shown) == 2
    assert best_viewpoint(~seen, shown) == 0


def test_boxes_stand_where_points_are_and_the_table_is_left_out():
    assert occupy(np.array([[0.1, 0.2, 0.0]])) is None
    point = np.array([0.101, 0.202, 0.051])
    vertices, faces = occupy(np.array([point, point + 1e-4, [0.3, 0.3, 0.001]]))
    assert vertices.shape == (8, 3)
    assert faces.shape == (12, 3)
    assert (vertices.min(axis=0) <= point).all()
    assert (vertices.max(axis=0) >= point).all()
    assert np.ptp(vertices, axis=0) == pytest.approx(VOXEL_M)
    cube = trimesh.Trimesh(vertices, faces)
    assert cube.is_watertight
    assert cube.volume == pytest.approx(VOXEL_M**3, rel=1e-6)
