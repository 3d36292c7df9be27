from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.candidate import Counterfactuals, Registrar
from gpca.causes.dataset import LABELS
from gpca.causes.truth import ALL, NONE
from gpca.reenactment.dataset import as_arrays, verdict
from gpca.reenactment.enactment import reenact
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from tests.reenactment.conftest import TRUTH, candidate_of, pair_of

SETTINGS = ReenactmentSettings()


def verdict_of(enactments, pair):
    arrays = as_arrays(enactments, pair, SETTINGS.hypotheses)
    return verdict(arrays["error"][None], arrays["weight"][None], TRUTH.limits)[0]


@pytest.mark.parametrize(("cause", "seed"), [("nominal", 100), ("noise", 100), ("pose", 100), ("overlap", 100)])
def test_a_clean_pair_is_nominal_and_each_strong_cause_is_named(drill, cause, seed):
    candidate = candidate_of(drill, cause, seed=seed)  # nominal is no cause
    pair, _ = pair_of(candidate)
    scores_4 = verdict_of(reenact(pair, SETTINGS, TRUTH), pair)
    assert LABELS[scores_4.argmax()] == cause
    assert scores_4.sum() == pytest.approx(1) and (scores_4 >= 0).all()


def test_what_is_enacted_is_near_the_truth_and_adds_up(drill):
    candidate = candidate_of(drill, "noise", "overlap", seed=104)
    pair, _ = pair_of(candidate)
    enacted = reenact(pair, SETTINGS, TRUTH)[0]
    assert enacted.phi_3.sum() == pytest.approx(enacted.error_8[ALL] - enacted.error_8[NONE])
    surface = ModelSurface(drill[:2000])
    xi = np.random.default_rng(5).normal(size=(13, 6)) * TRUTH.deviation_6()
    measured = Counterfactuals(Registrar(candidate, TRUTH), surface.errors, xi, TRUTH)
    true = np.array([measured.error(subset) for subset in range(8)])
    assert np.corrcoef(enacted.error_8, true)[0, 1] > 0.8
    assert (enacted.uncertainty_8 >= 0).all() and enacted.uncertainty_8[NONE] == 0


def test_the_same_pair_has_the_same_numbers_and_another_sample_other_starts(drill):
    pair, _ = pair_of(candidate_of(drill, "noise"))
    first, again = (reenact(pair, SETTINGS, TRUTH)[0].error_8 for _ in range(2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, reenact(replace(pair, axes=("other",)), SETTINGS, TRUTH)[0].error_8)


def test_what_finds_no_partner_is_as_wrong_as_can_be(drill):
    pair, _ = pair_of(candidate_of(drill))
    far = pair.T_init.copy()
    far[:3, 3] += 5
    enacted = reenact(replace(pair, T_init=far), SETTINGS, TRUTH)[0]
    assert enacted.error_8[ALL] == 0.5
    assert enacted.error_8[NONE] < 0.1
