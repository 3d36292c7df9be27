"""A corner of a room whose registrations are re-enacted by an observer who does not know the true pose."""

import numpy as np
import pytest

from gpca.causes.dataset import LABELS
from gpca.causes.scans import LADDER, ScanStart, measure_scans
from gpca.causes.settings import OBSERVED, CauseSettings
from gpca.causes.truth import ALL
from gpca.reenactment.dataset import Reenactments
from gpca.reenactment.enactment import NoiseScale
from gpca.reenactment.hypotheses import Hypothesis
from gpca.reenactment.scans import cropped, reenact_scans
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import rotation_angle_rad, scale_translation
from gpca.scans.pair import ScanSuccess
from tests.reenactment.conftest import without_truth
from tests.scans.corner import corner_pair, start_off

NUMBERS = set(Reenactments.array_fields()) - {"sample", "split"}

TRUTH = CauseSettings(moved=OBSERVED, clean_pairs=20)
SETTINGS = ReenactmentSettings(2)
POINTS = 192


def measured(pair, *starts):
    registered = [ScanStart(0, LADDER, f"rung{n}", start) for n, start in enumerate(starts)]
    return measure_scans([pair], registered, "corner", 100, TRUTH, ScanSuccess(), POINTS)


@pytest.fixture(scope="module")
def good_and_bad():
    """A registration from near the truth, and one from far off."""
    pair = corner_pair(0.8)
    return measured(pair, start_off(pair, 4, 0.05), start_off(pair, 70, 0.9))


@pytest.fixture(scope="module")
def enacted(good_and_bad):
    causes, table = good_and_bad
    return reenact_scans(causes, table["error_factor"].to_numpy(), SETTINGS, TRUTH)


def test_what_is_wrong_is_named_and_the_true_pose_found_without_the_truth(good_and_bad, enacted):
    causes, _ = good_and_bad
    named = [LABELS[row] for row in enacted.verdict.argmax(axis=1)]
    assert named == ["nominal", "pose"] == [causes.truth.state[0], causes.truth.dominant[1]]
    assert enacted.error[:, 0, ALL] == pytest.approx(causes.truth.error[:, ALL], abs=0.05)
    registrations = good_and_bad[0].registrations
    T_true = scale_translation(registrations.T_target_source_true[1], 1 / registrations.diameter_m[1])
    T_off = enacted.T_model_observed[1, 0] @ np.linalg.inv(T_true)
    assert np.rad2deg(rotation_angle_rad(T_off)) < 8  # of 70 at the start


def test_nothing_that_only_the_truth_knows_is_read(good_and_bad, enacted):
    causes, table = good_and_bad
    without = without_truth(causes)
    again = reenact_scans(without, table["error_factor"].to_numpy(), SETTINGS, TRUTH)
    for name in NUMBERS:
        assert np.array_equal(getattr(enacted, name), getattr(again, name)), name


def at(T, points):
    return Hypothesis(T, np.ones(len(points)), 0.0, 0.02, 1.0, 0.0, np.zeros(len(points)))


@pytest.fixture
def beside():
    """Two flat scans: half of either lies beside the other."""
    random = np.random.default_rng(100)
    model, observed = (np.column_stack([random.uniform(0, 1, (400, 2)), np.zeros(400)]) for _ in range(2))
    observed[:, 0] += 0.5
    surface = ModelSurface(model)
    return observed, surface, NoiseScale(surface, random)


def test_both_scans_are_cropped_to_what_they_have_in_common_under_a_hypothesis(beside):
    observed, *known = beside
    candidate = cropped(at(np.eye(4), observed), observed, *known)
    assert len(candidate.seen) / 400 == pytest.approx(0.6, abs=0.15)
    assert candidate.clean[candidate.seen, 0].max() < 1.2 and candidate.reference(())[:, 0].min() > 0.3
    assert candidate.severity["crop"] == pytest.approx(0.45, abs=0.15)
    away = np.eye(4)
    away[0, 3] = 5.0
    nothing = cropped(at(away, observed), observed, *known)
    assert not nothing.applied[2] and len(nothing.seen) == 400


def test_noise_is_taken_from_the_common_points_alone(beside):
    observed, *known = beside
    observed[:, 2] += 0.03 * np.random.default_rng(1).normal(size=400)
    candidate = cropped(at(np.eye(4), observed), observed, *known)
    moved = np.abs(candidate.clean - candidate.noisy).max(axis=1) > 0
    assert candidate.applied[0] and set(np.flatnonzero(moved)) <= set(candidate.seen)
    assert np.abs(candidate.clean[candidate.seen, 2]).mean() < 0.5 * np.abs(candidate.noisy[candidate.seen, 2]).mean()
