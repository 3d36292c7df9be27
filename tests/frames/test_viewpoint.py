import numpy as np
import pytest

from gpca.frames.camera import Camera
from gpca.frames.shots import VOXEL_M, Shot, best_viewpoint, candidates, expected_surface, occupy

CAMERA = Camera(192, 144, 180)
CENTRE = np.array([0.1, -0.05, 0.06])


def box():
    import trimesh

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
    import trimesh

    cube = trimesh.Trimesh(vertices, faces)
    assert cube.is_watertight
    assert cube.volume == pytest.approx(VOXEL_M**3, rel=1e-6)
