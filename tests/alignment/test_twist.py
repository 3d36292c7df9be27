import numpy as np
import pytest
from scipy.linalg import expm

from gpca.alignment.rigid import adjoint, exp, log, point_jacobians, rotation_angle_rad


def hat(xi_6):
    """4×4 matrix of a twist (rotation, translation)."""
    (x, y, z), translation = xi_6[:3], xi_6[3:]
    return np.block([[np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), translation[:, None]], [np.zeros((1, 4))]])


def twists(angle_rad, n=20):
    """Random twists whose rotation is by `angle_rad`."""
    xi_n_6 = np.random.default_rng(0).normal(size=(n, 6))
    xi_n_6[:, :3] *= angle_rad / np.linalg.norm(xi_n_6[:, :3], axis=1, keepdims=True)
    return xi_n_6


ANGLES = (0.0, 1e-300, 1e-12, 1e-8, 9.99e-5, 1.0001e-4, 1e-3, 0.1, 1.0, 2.0, 3.0, np.pi - 1e-3, np.pi - 1e-7)


@pytest.mark.parametrize("angle", ANGLES)
def test_exp_is_the_matrix_exponential(angle):
    xi_n_6 = twists(angle)
    assert np.allclose(exp(xi_n_6), [expm(hat(xi_6)) for xi_6 in xi_n_6], rtol=0, atol=1e-11)


@pytest.mark.parametrize("angle", ANGLES)
def test_log_undoes_exp(angle):
    xi_n_6 = twists(angle)
    assert np.allclose(log(exp(xi_n_6)), xi_n_6, rtol=0, atol=1e-7 if angle > 3.1 else 1e-10)


@pytest.mark.parametrize("angle", [np.pi, np.pi - 1e-9, np.pi + 1e-9, 4.0, 6.0, 9.0])
def test_beyond_half_a_turn_log_takes_the_shorter_way_to_the_same_motion(angle):
    T_n = exp(twists(angle))
    xi_n_6 = log(T_n)
    assert (np.linalg.norm(xi_n_6[:, :3], axis=1) <= np.pi + 1e-9).all()
    assert np.allclose(exp(xi_n_6), T_n, atol=1e-6)


def test_motions_are_rigid_and_turn_by_the_twists_angle():
    for angle in (1e-3, 0.5, 3.0):
        T_n = exp(twists(angle))
        R_n = T_n[:, :3, :3]
        assert np.allclose(R_n @ np.swapaxes(R_n, 1, 2), np.eye(3), atol=1e-12)
        assert np.array_equal(T_n[:, 3], np.tile([0, 0, 0, 1], (len(T_n), 1)))
        assert [rotation_angle_rad(T) for T in T_n] == pytest.approx([angle] * len(T_n), rel=1e-6)


def test_the_identity_and_pure_translations():
    assert np.array_equal(exp(np.zeros((1, 6))), np.eye(4)[None])
    assert np.array_equal(log(np.eye(4)[None]), np.zeros((1, 6)))
    T = exp(np.array([[0, 0, 0, 1.0, -2.0, 3.0]]))[0]
    assert np.array_equal(T[:3, 3], [1, -2, 3]) and np.array_equal(T[:3, :3], np.eye(3))


def test_half_of_a_twist_twice_is_the_whole():
    xi_n_6 = twists(1.5)
    half_n = exp(xi_n_6 / 2)
    assert np.allclose(half_n @ half_n, exp(xi_n_6), atol=1e-12)
    assert np.allclose(exp(xi_n_6) @ exp(-xi_n_6), np.eye(4), atol=1e-12)


def test_the_adjoint_takes_a_twist_to_another_frame():
    T = exp(np.array([[0.4, -1.0, 0.7, 0.3, 0.1, -0.2]]))[0]
    for xi_6 in twists(0.8, 5):
        assert np.allclose(exp((adjoint(T) @ xi_6)[None])[0], T @ exp(xi_6[None])[0] @ np.linalg.inv(T), atol=1e-12)


def test_points_move_by_their_jacobians():
    points = np.random.default_rng(0).normal(size=(7, 3))
    for axis in np.eye(6):
        moved = points @ exp(1e-6 * axis[None])[0][:3, :3].T + exp(1e-6 * axis[None])[0][:3, 3]
        assert np.allclose((moved - points) / 1e-6, point_jacobians(points) @ axis, atol=1e-5)
