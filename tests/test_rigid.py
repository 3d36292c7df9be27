import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from gpca import rigid
from gpca.errors import InputError

RANDOM = np.random.default_rng(0)
SOURCE = RANDOM.normal(size=(30, 3))
MOTION = rigid.exp(RANDOM.normal(size=(1, 6)))[0]
NOISY = rigid.transform(MOTION, SOURCE) + RANDOM.normal(scale=0.1, size=(30, 3))
WEIGHTS = RANDOM.uniform(size=30)


def pose(seed=0):
    return rigid.rigid_motion(Rotation.random(rng=np.random.default_rng(seed)).as_matrix(), [0.3, -0.2, 0.1])


def test_motions_and_their_inverses_move_one_point_or_many_in_any_unit():
    R_n = Rotation.random(5, rng=np.random.default_rng(0)).as_matrix()
    shift_n_3 = np.random.default_rng(1).normal(size=(5, 3))
    for T_b_a, R, shift_3 in zip(rigid.rigid_motion(R_n, shift_n_3), R_n, shift_n_3, strict=True):
        assert np.array_equal(T_b_a, rigid.rigid_motion(R, shift_3))
        assert rigid.transform(T_b_a, np.ones(3)) == pytest.approx(R @ np.ones(3) + shift_3)
    assert np.array_equal(rigid.rigid_motion(np.eye(3)), np.eye(4))
    assert np.allclose(rigid.inverse(pose()), np.linalg.inv(pose()))
    assert np.allclose(rigid.inverse(pose()) @ pose(), np.eye(4))
    points_a = np.random.default_rng(1).normal(size=(20, 3))
    homogeneous = np.column_stack([points_a, np.ones(20)])
    assert np.allclose(rigid.transform(pose(), points_a), (pose() @ homogeneous.T).T[:, :3])
    points_m, T_m = np.random.default_rng(1).normal(size=(20, 3)), pose()
    T_mm = rigid.scale_translation(T_m, 1000)
    assert np.allclose(rigid.transform(T_mm, 1000 * points_m), 1000 * rigid.transform(T_m, points_m))
    assert np.array_equal(T_m, pose())


@pytest.mark.parametrize("angle_rad", [0.0, 1e-7, 1e-3, 0.5, 3.0, np.pi])
def test_the_angle_is_that_of_the_rotation(angle_rad):
    T_b_a = pose()
    T_b_a[:3, :3] = Rotation.from_rotvec(angle_rad * np.array([0.6, 0.0, 0.8])).as_matrix()
    assert rigid.rotation_angle_rad(T_b_a) == pytest.approx(angle_rad, rel=1e-8, abs=1e-12)


def test_directions_are_unit_and_favour_no_side():
    random = np.random.default_rng(0)
    directions = np.array([rigid.random_direction(random) for _ in range(4000)])
    assert np.allclose(np.linalg.norm(directions, axis=1), 1)
    # Uniform on the sphere: mean 0, covariance I/3 (their standard errors are about 0.01).
    assert np.abs(directions.mean(axis=0)).max() < 0.04
    assert np.abs(directions.T @ directions / len(directions) - np.eye(3) / 3).max() < 0.04


@pytest.mark.parametrize(
    ("T_b_a", "message"),
    [
        (np.eye(3), r"my pose: the pose has shape \(3, 3\)"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "my pose: the pose is not a rigid transform"),
        (np.full((4, 4), np.nan), "my pose: the pose is not a rigid transform"),
        (pose().T, "its last row must be 0 0 0 1"),
    ],
)
def test_what_is_no_rigid_transform_is_refused(T_b_a, message):
    rigid.require_rigid(pose(), "my pose")
    with pytest.raises(InputError, match=message):
        rigid.require_rigid(T_b_a, "my pose")


def test_vectors_are_turned_by_sums_from_x_to_z_whatever_their_layout():
    random = np.random.default_rng(100)
    R = np.linalg.qr(random.normal(size=(3, 3)))[0]
    vectors = random.normal(size=(101, 3))
    columns = [vectors[:, 0] * row[0] + vectors[:, 1] * row[1] + vectors[:, 2] * row[2] for row in R]
    for given in (vectors, np.asfortranarray(vectors), np.repeat(vectors, 2, axis=0)[::2]):
        assert np.array_equal(rigid.rotate(R, given), np.stack(columns, axis=1))
        assert np.array_equal(rigid.rotate(np.asfortranarray(R), given), np.stack(columns, axis=1))
    assert np.allclose(rigid.rotate(R, vectors), vectors @ R.T)
    assert np.array_equal(rigid.rotate(R, vectors.reshape(1, 101, 1, 3))[0, :, 0], rigid.rotate(R, vectors))


def test_a_rotation_is_scipys_and_never_a_reflection():
    expected, _ = Rotation.align_vectors(NOISY, SOURCE, weights=WEIGHTS)
    np.testing.assert_allclose(rigid.best_rotation(SOURCE, NOISY, WEIGHTS), expected.as_matrix(), atol=1e-12)
    R = rigid.best_rotation(SOURCE, SOURCE * [1, 1, -1], np.ones(30))
    assert np.linalg.det(R) == pytest.approx(1)


def test_a_motion_is_the_minimum_of_the_weighted_squares():
    def residuals(xi_6):
        return (np.sqrt(WEIGHTS)[:, None] * (NOISY - rigid.transform(rigid.exp(xi_6[None])[0], SOURCE))).ravel()

    found = least_squares(residuals, rigid.log(MOTION[None])[0], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    np.testing.assert_allclose(rigid.best_motion(SOURCE, NOISY, WEIGHTS), rigid.exp(found.x[None])[0], atol=1e-6)


@pytest.mark.parametrize("flat", [[1, 1, 0], [1, 0, 0], [0, 0, 0]])
def test_a_flat_cloud_gives_a_rotation_and_no_mirror(flat):
    T = rigid.best_motion(SOURCE * flat, -SOURCE * flat, np.ones(30))
    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-9)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1)


def test_steps_to_planes_reach_a_known_motion_but_for_what_one_plane_leaves_open():
    normals = RANDOM.normal(size=(30, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    motion = rigid.exp(np.array([[0.1, -0.2, 0.1, 0.3, 0.1, -0.2]]))[0]
    target = rigid.transform(motion, SOURCE)
    target += np.cross(normals, RANDOM.normal(size=(30, 3)))  # anywhere on the plane
    T = np.eye(4)
    for _ in range(20):
        T = rigid.plane_step(rigid.transform(T, SOURCE), target, normals, WEIGHTS) @ T
    np.testing.assert_allclose(T, motion, atol=1e-9)
    points = SOURCE * [1, 1, 0]
    T = rigid.plane_step(points, points + np.array([0.7, -0.4, 0.1]), np.tile([0.0, 0.0, 1.0], (30, 1)), np.ones(30))
    np.testing.assert_allclose(T[:3, 3], [0, 0, 0.1], atol=1e-9)
    np.testing.assert_allclose(rigid.rotate(T, np.array([0.0, 0.0, 1.0])), [0, 0, 1], atol=1e-9)


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
def test_exp_is_the_matrix_exponential_and_log_undoes_it(angle):
    xi_n_6 = twists(angle)
    assert np.allclose(rigid.exp(xi_n_6), [expm(hat(xi_6)) for xi_6 in xi_n_6], rtol=0, atol=1e-11)
    assert np.allclose(rigid.log(rigid.exp(xi_n_6)), xi_n_6, rtol=0, atol=1e-7 if angle > 3.1 else 1e-10)


@pytest.mark.parametrize("angle", [np.pi, np.pi - 1e-9, np.pi + 1e-9, 4.0, 6.0, 9.0])
def test_beyond_half_a_turn_log_takes_the_shorter_way_to_the_same_motion(angle):
    T_n = rigid.exp(twists(angle))
    xi_n_6 = rigid.log(T_n)
    assert (np.linalg.norm(xi_n_6[:, :3], axis=1) <= np.pi + 1e-9).all()
    assert np.allclose(rigid.exp(xi_n_6), T_n, atol=1e-6)


def test_the_adjoint_takes_a_twist_to_another_frame_and_jacobians_move_points():
    T = rigid.exp(np.array([[0.4, -1.0, 0.7, 0.3, 0.1, -0.2]]))[0]
    for xi_6 in twists(0.8, 5):
        assert np.allclose(
            rigid.exp((rigid.adjoint(T) @ xi_6)[None])[0], T @ rigid.exp(xi_6[None])[0] @ np.linalg.inv(T), atol=1e-12
        )
    points = np.random.default_rng(0).normal(size=(7, 3))
    for axis in np.eye(6):
        moved = points @ rigid.exp(1e-6 * axis[None])[0][:3, :3].T + rigid.exp(1e-6 * axis[None])[0][:3, 3]
        assert np.allclose((moved - points) / 1e-6, rigid.point_jacobians(points) @ axis, atol=1e-5)


def test_a_pose_that_is_written_moves_far_points_as_it_does_itself():
    """At UTM coordinates, six significant digits moved a scan by more than a meter."""
    random = np.random.default_rng(0)
    for center, diameter in ((np.zeros(3), 0.2), (np.array([539719.56, 4065739.2, 1.8]), 40.0), (np.full(3, 4e6), 0.2)):
        T = rigid.exp(np.array([[0.02, -0.01, 0.4, 0.1, 0.2, 0.3]]))[0]
        T[:3, 3] += center - T[:3, :3] @ center
        reach = 2 * np.linalg.norm(center) / diameter + 1
        read = np.array([[float(word) for word in row.split()] for row in rigid.as_rows(T, reach)])
        points = center + diameter * random.uniform(-0.5, 0.5, (100, 3))
        assert np.abs(rigid.transform(read, points) - rigid.transform(T, points)).max() < 1e-6 * diameter
    assert rigid.as_rows(np.eye(4), 1.0)[0].split() == ["1.000000000", "0.000000000", "0.000000000", "0.000000000"]
