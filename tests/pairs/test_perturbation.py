import numpy as np
import pytest
from scipy.optimize import linprog

from gpca.pairs.perturbation import CONCEPTS, PERTURBATIONS, Severities, add_noise, crop, misplace
from gpca.rigid import rotation_angle_rad, transform

POINTS = np.random.default_rng(0).uniform(-0.5, 0.5, size=(2000, 3))
LIMITS = {
    "noise": (0.01, 0.03),
    "rotation_rad": (np.pi / 12, np.pi / 3),
    "translation": (0.05, 0.3),
    "crop": (0.2, 0.6),
}
DRAWN = {"noise": {"noise"}, "pose": {"rotation_rad", "translation"}, "overlap": {"crop"}}


def perturbed(concept, seed):
    return PERTURBATIONS[concept](POINTS, Severities(), np.random.default_rng(seed))


@pytest.mark.parametrize("concept", CONCEPTS)
def test_severities_fill_their_range_and_no_other_is_applied(concept):
    drawn = [perturbed(concept, seed).severity for seed in range(200)]
    assert {frozenset(severity) for severity in drawn} == {frozenset(DRAWN[concept])}
    for name in DRAWN[concept]:
        low, high = LIMITS[name]
        values = np.array([severity[name] for severity in drawn])
        assert low <= values.min() < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < values.max() <= high
        assert values.mean() == pytest.approx((low + high) / 2, abs=0.08 * (high - low))


@pytest.mark.parametrize("concept", CONCEPTS)
def test_the_clean_points_are_left_as_they_are_and_a_seed_repeats_its_draw(concept):
    before = POINTS.copy()
    one, again, other = (perturbed(concept, seed).points for seed in (1, 1, 2))
    assert np.array_equal(POINTS, before)
    assert np.array_equal(one, again)
    assert not np.array_equal(one[:500], other[:500])


@pytest.mark.parametrize("seed", range(3))
def test_noise_has_the_drawn_deviation_in_every_coordinate(seed):
    noisy = perturbed("noise", seed)
    jitter = noisy.points - POINTS
    sigma = noisy.severity["noise"]
    assert jitter.std(axis=0) == pytest.approx(sigma, rel=0.06)
    assert np.abs(jitter.mean(axis=0)).max() < 5 * sigma / np.sqrt(len(POINTS))
    assert np.array_equal(noisy.T_target_source_true, np.eye(4))


@pytest.mark.parametrize("seed", range(3))
def test_the_true_pose_takes_the_moved_points_back(seed):
    moved = perturbed("pose", seed)
    assert np.allclose(transform(moved.T_target_source_true, moved.points), POINTS, atol=1e-12)
    assert rotation_angle_rad(moved.T_target_source_true) == pytest.approx(moved.severity["rotation_rad"])
    # The rotation is about the object's centre, so the centre moves by the translation alone.
    assert np.linalg.norm(moved.T_target_source_true[:3, 3]) == pytest.approx(moved.severity["translation"])
    assert np.linalg.det(moved.T_target_source_true[:3, :3]) == pytest.approx(1)


@pytest.mark.parametrize("seed", range(3))
def test_a_crop_loses_the_drawn_share_beyond_a_plane(seed):
    cropped = perturbed("overlap", seed)
    kept = (POINTS[:, None] == cropped.points[None]).all(axis=2).any(axis=1)
    assert np.array_equal(POINTS[kept], cropped.points)
    assert kept.sum() == round(len(POINTS) * (1 - cropped.severity["crop"]))
    # Some plane (a, b) has a·p + b <= -1 for the kept and >= 1 for the lost points: a feasible linear programme.
    sides = np.where(kept, 1.0, -1.0)[:, None] * np.column_stack([POINTS, np.ones(len(POINTS))])
    assert linprog(np.zeros(4), A_ub=sides, b_ub=-np.ones(len(POINTS)), bounds=(None, None)).status == 0
    assert np.array_equal(cropped.T_target_source_true, np.eye(4))


@pytest.mark.parametrize(
    ("perturb", "changed", "name", "value"),
    [
        (add_noise, {"noise": (0.2, 0.2)}, "noise", 0.2),
        (misplace, {"rotation_deg": (90, 90)}, "rotation_rad", np.pi / 2),
        (misplace, {"translation": (0.0, 0.0)}, "translation", 0.0),
        (crop, {"crop": (0.9, 0.9)}, "crop", 0.9),
    ],
)
def test_the_ranges_are_those_of_the_settings(perturb, changed, name, value):
    assert perturb(POINTS, Severities(**changed), np.random.default_rng(0)).severity[name] == pytest.approx(value)


def test_a_crop_leaves_a_point_however_much_it_cuts_off():
    assert len(crop(POINTS[:5], Severities(crop=(1.0, 1.0)), np.random.default_rng(0)).points) == 1
