from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.settings import CauseSettings
from gpca.errors import InputError
from gpca.reenactment.dataset import FEATURES, Reenactments, reenact_all, reenactment_features
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


def test_every_row_has_finite_numbers_probabilities_that_add_up_and_seconds(some, enacted):
    found, seconds_S, icp_seconds_S = enacted
    assert found.weight.shape == (len(some), 3)
    assert found.weight.sum(axis=1) == pytest.approx(1) and (np.diff(found.weight, axis=1) <= 0).all()
    assert found.verdict.sum(axis=1) == pytest.approx(1)
    features = reenactment_features(found)
    assert features.shape == (len(some), len(FEATURES) + found.described.shape[1]) and np.isfinite(features).all()
    assert (seconds_S > icp_seconds_S).all() and (icp_seconds_S > 0).all()


def test_a_re_enactment_does_not_depend_on_the_truth_or_on_other_rows(some, enacted):
    two = some.subset(np.array([3, 1]))
    again, _, _ = reenact_all(
        replace(two, registrations=two.registrations.without_labels()), "four", 100, SETTINGS, CauseSettings()
    )
    for name in NUMBERS:
        assert np.array_equal(getattr(again, name), getattr(enacted[0], name)[[3, 1]])


def test_a_file_is_read_as_it_was_written_and_only_for_its_own_samples(some, enacted, tmp_path):
    path = tmp_path / "reenactments.npz"
    enacted[0].save(path)
    read = Reenactments.load(path, some.registrations)
    assert all(np.array_equal(getattr(read, name), getattr(enacted[0], name)) for name in NUMBERS)
    with pytest.raises(InputError, match="its samples differ from those of the registrations"):
        Reenactments.load(path, some.registrations.subset(np.array([2, 1, 0, 3, 4, 5])))
    arrays = dict(np.load(path))
    np.savez(path, **arrays | {"error": arrays["error"][..., :7]})
    with pytest.raises(InputError, match="array 'error' is 6×3×7, not 6×3×8"):
        Reenactments.load(path, some.registrations)
    np.savez(path, **arrays | {"error": arrays["error"] * np.nan})
    with pytest.raises(InputError, match="array 'error' contains NaN"):
        Reenactments.load(path, some.registrations)


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
