from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.settings import CauseSettings, Limits
from gpca.errors import InputError
from gpca.reenactment.dataset import FEATURES, Reenactments, reenact_all, reenactment_features, verdict
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import read_settings

NUMBERS = set(Reenactments.array_fields()) - {"sample", "split"}

SETTINGS = ReenactmentSettings(hypotheses=3)


@pytest.fixture(scope="module")
def some(causes):
    return causes.subset(np.arange(6))


@pytest.fixture(scope="module")
def enacted(some):
    return reenact_all(some, "four", 100, SETTINGS, CauseSettings())


def test_every_row_has_finite_numbers_by_neither_the_truth_nor_other_rows_and_seconds(some, enacted):
    found, seconds_S, icp_seconds_S = enacted
    assert found.weight.shape == (len(some), 3)
    assert found.weight.sum(axis=1) == pytest.approx(1) and (np.diff(found.weight, axis=1) <= 0).all()
    assert found.verdict.sum(axis=1) == pytest.approx(1)
    features = reenactment_features(found)
    assert features.shape == (len(some), len(FEATURES) + found.described.shape[1]) and np.isfinite(features).all()
    assert (seconds_S > icp_seconds_S).all() and (icp_seconds_S > 0).all()
    two = some.subset(np.array([3, 1]))
    hidden = replace(two, registrations=two.registrations.without_labels())
    again, _, _ = reenact_all(hidden, "four", 100, SETTINGS, CauseSettings())
    for name in NUMBERS:
        assert np.array_equal(getattr(again, name), getattr(enacted[0], name)[[3, 1]])


def test_a_file_is_read_as_it_was_written_and_only_for_its_own_samples(some, enacted, tmp_path):
    path = tmp_path / "reenactments.npz"
    enacted[0].save(path)
    read = Reenactments.load(path, some.registrations)
    assert all(np.array_equal(getattr(read, name), getattr(enacted[0], name)) for name in NUMBERS)
    with pytest.raises(InputError, match="its samples differ from those of the registrations"):
        Reenactments.load(path, some.registrations.subset(np.array([2, 1, 0, 3, 4, 5])))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"hypotheses": 1}, "hypotheses"),
        ({"good_starts": 1.0}, "good_starts"),
        ({"good_rotation_deg": 0}, "good_rotation_deg"),
        ({"bad_translation": -1}, "bad_translation"),
        ({"spike": 4}, "spike"),
    ],
)
def test_settings_out_of_bounds_are_named(changes, message):
    with pytest.raises(InputError, match=message):
        read_settings(ReenactmentSettings, changes)


LIMITS = Limits()
ONE = np.array([1.0, 0, 0])


def errors_of(*phi, none=0.005):
    """The errors that causes with these φ make, each by itself."""
    return np.array([none + sum(phi[i] for i in range(3) if subset >> i & 1) for subset in range(8)])


def judged(*hypotheses, weight=None):
    errors_K_8 = np.array(hypotheses)
    return verdict(errors_K_8[None], np.array(weight or ONE[: len(hypotheses)])[None], LIMITS)[0]


def test_scores_follow_the_limits_the_shares_and_the_probability_of_each_hypothesis():
    middle = np.sqrt(LIMITS.nominal * LIMITS.failed)
    assert judged(errors_of(middle - 0.005, 0, 0))[0] == pytest.approx(0.5)
    assert judged(errors_of(0.001, 0.001, 0))[0] > 0.95
    assert judged(errors_of(0.2, 0, 0))[0] < 0.01
    scores = judged(errors_of(0.02, 0.10, 0.05))
    assert np.argsort(scores).tolist() == [0, 1, 3, 2]
    even = judged(errors_of(0.05, 0.05, 0.05))
    assert even[1:] == pytest.approx(np.full(3, even[1]))
    noise, pose = errors_of(0.3, 0, 0), errors_of(0, 0.3, 0)
    scores = judged(noise, pose, weight=[0.75, 0.25])
    assert scores[1:3] == pytest.approx([0.75, 0.25], abs=0.01)
