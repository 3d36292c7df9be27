import numpy as np
import pytest

from gpca.objects.camera import NOTHING, Camera, DepthNoise, MeshScene, back_project, look_at
from gpca.rigid import inverse, transform

CAMERA = Camera(width=80, height=60, focal_px=70)
WALL = (np.array([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], float), np.array([[0, 1, 2], [0, 2, 3]]))


def from_above(height_m, tilt_deg=0.0):
    tilt = np.deg2rad(tilt_deg)
    return look_at(height_m * np.array([np.sin(tilt), 1e-6, np.cos(tilt)]), np.zeros(3))


def test_a_camera_looks_at_its_target_upright_and_what_it_sees_is_projected_back_onto_it():
    T_world_camera = from_above(0.8, tilt_deg=40)
    view = MeshScene([WALL]).look(CAMERA, T_world_camera)
    points, pixels = back_project(view.depth_m, view.mesh == 0, CAMERA.matrix_3_3)
    assert len(points) == CAMERA.width * CAMERA.height
    assert abs(transform(T_world_camera, points)[:, 2]).max() < 1e-5
    assert np.allclose(view.depth_m[tuple(pixels[:, ::-1].T)], points[:, 2])
    T_world_camera = look_at(np.array([0.5, -0.4, 0.3]), np.array([0.1, 0.0, 0.05]))
    target, above = transform(inverse(T_world_camera), np.array([[0.1, 0.0, 0.05], [0.1, 0.0, 0.15]]))
    assert np.allclose(target[:2], 0)
    assert target[2] > 0
    assert above[1] < -0.05  # the image's y points down
    assert abs(above[0]) < 1e-9


def test_the_nearer_mesh_is_seen_and_where_there_is_none_no_depth():
    small = (0.1 * WALL[0] / 9, WALL[1])
    view = MeshScene([small]).look(CAMERA, from_above(0.8))
    assert set(np.unique(view.mesh)) == {NOTHING, 0}
    assert np.isinf(view.depth_m[view.mesh == NOTHING]).all()
    assert np.array_equal(MeshScene([small]).silhouette(CAMERA, from_above(0.8)), view.mesh == 0)
    assert not DepthNoise().measure(view, np.random.default_rng(0))[0, 0]
    near = (0.05 * WALL[0] + [0, 0, 0.2], WALL[1])
    view = MeshScene([WALL, near]).look(CAMERA, from_above(0.8))
    assert view.mesh[30, 40] == 1
    assert view.depth_m[30, 40] == pytest.approx(0.6, abs=1e-4)


@pytest.mark.parametrize("distance_m", [0.5, 1.5])
def test_axial_noise_has_the_published_deviation(distance_m):
    view = MeshScene([WALL]).look(CAMERA, from_above(distance_m))
    errors_m = DepthNoise(dropout=0.0).measure(view, np.random.default_rng(1)) - view.depth_m
    assert errors_m.std() == pytest.approx(0.0012 + 0.0019 * (distance_m - 0.4) ** 2, rel=0.05)
    assert abs(errors_m.mean()) < 1e-4


def test_lateral_noise_frays_edges_and_nothing_else():
    near = (0.02 * WALL[0] + [0, 0, 0.2], WALL[1])
    view = MeshScene([WALL, near]).look(CAMERA, from_above(0.8))
    seen_m = DepthNoise(dropout=0.0).measure(view, np.random.default_rng(2))
    wrong_mesh = abs(seen_m - view.depth_m) > 0.1
    rows, columns = np.nonzero(view.mesh == 1)
    inside = np.zeros_like(wrong_mesh)
    inside[rows.min() + 6 : rows.max() - 5, columns.min() + 6 : columns.max() - 5] = True
    assert inside.sum() > 100
    assert wrong_mesh.sum() > 20
    assert not wrong_mesh[inside].any()


def test_steep_surfaces_and_the_declared_share_drop_out():
    steep = MeshScene([WALL]).look(CAMERA, from_above(0.8, tilt_deg=60))
    assert not DepthNoise(grazing_deg=20).measure(steep, np.random.default_rng(0)).any()
    flat = MeshScene([WALL]).look(CAMERA, from_above(0.8))
    lost = DepthNoise(dropout=0.2).measure(flat, np.random.default_rng(0)) == 0
    assert lost.mean() == pytest.approx(0.2, abs=0.03)
