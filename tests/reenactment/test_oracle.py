"""Re-enactments that are told parts of the truth."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.dataset import LABELS
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import ALL, SUBSETS
from gpca.errors import InputError
from gpca.pairs.perturbation import NOISE, OVERLAP, POSE
from gpca.reenactment.dataset import reenact_all
from gpca.reenactment.enactment import NoiseScale, observe, rebuild
from gpca.reenactment.hypotheses import Hypothesis
from gpca.reenactment.oracle import ask_oracles, informed
from gpca.reenactment.settings import EVERYTHING, KNOWN, NOTHING, ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import inverse
from tests.conftest import FEW_CAUSES
from tests.reenactment.conftest import candidate_of, surface_of

SETTINGS, TRUTH = ReenactmentSettings(hypotheses=2), CauseSettings(**FEW_CAUSES)
ALL_CAUSES = ("noise", "pose", "overlap")


@pytest.fixture(scope="module")
def some(causes):
    return causes.subset(causes.rows("test")[:3])


@pytest.fixture(scope="module")
def drill(four):
    return surface_of(four, "035_power_drill")


@pytest.fixture(scope="module")
def asked(four, some):
    return ask_oracles(four, some, "four", 100, SETTINGS, TRUTH)


def rebuilt_at_the_truth(candidate):
    random, causes = np.random.default_rng(0), tuple(np.flatnonzero(candidate.applied).tolist())
    surface = ModelSurface(candidate.model)
    observed = candidate.observed(causes)
    none, every = np.zeros(len(observed)), np.ones(len(observed))
    hypothesis = Hypothesis(inverse(candidate.start(causes)), every, 0.0, 0.02, 1.0, 0.0, none)
    before = observed @ candidate.start(causes)[:3, :3].T + candidate.start(causes)[:3, 3]
    observation = observe(before, hypothesis, surface, NoiseScale(surface, random), random)
    return rebuild(hypothesis.T, observation, surface, random)


def told(candidate, *known):
    return informed(rebuilt_at_the_truth(candidate), np.eye(4), candidate, known, np.random.default_rng(1))


def test_every_set_of_causes_may_be_known():
    assert set(KNOWN.values()) == set(SUBSETS) and len(KNOWN) == len(SUBSETS)
    assert KNOWN[NOTHING] == () and KNOWN[EVERYTHING] == SUBSETS[ALL]


def test_who_knows_nothing_says_what_the_re_enactment_says_and_who_knows_more_says_something_else(four, some, asked):
    enacted, _, _ = reenact_all(some, "four", 100, SETTINGS, TRUTH)
    assert asked[NOTHING].scores_N_C == pytest.approx(enacted.verdict, abs=1e-12)
    assert list(asked) == list(KNOWN)
    for name, attribution in asked.items():
        assert attribution.concepts == LABELS
        assert attribution.scores_N_C.sum(axis=1) == pytest.approx(1)
        assert name == NOTHING or not np.array_equal(attribution.scores_N_C, asked[NOTHING].scores_N_C)


def test_a_row_does_not_depend_on_others(four, some, asked):
    alone = ask_oracles(four, some.subset(np.array([2])), "four", 100, SETTINGS, TRUTH)
    for name in KNOWN:
        assert np.array_equal(alone[name].scores_N_C[0], asked[name].scores_N_C[2])


def test_known_points_without_noise_are_where_they_were_before_it(drill):
    candidate = candidate_of(drill, *ALL_CAUSES)
    found = told(candidate, NOISE)
    assert found.observed((OVERLAP,)) == pytest.approx(candidate.observed((OVERLAP,)), abs=1e-9)
    assert found.observed((NOISE, OVERLAP)) == pytest.approx(candidate.observed((NOISE, OVERLAP)), abs=1e-9)
    added = slice(len(candidate.kept), None)
    jitter = np.linalg.norm(found.noisy[added] - found.clean[added], axis=1)
    assert np.median(jitter) == pytest.approx(1.538 * candidate.severity["noise"], rel=0.2)


def test_known_missing_surface_is_what_was_cut_off(drill):
    candidate = candidate_of(drill, *ALL_CAUSES)
    found, hidden = told(candidate, OVERLAP), np.setdiff1d(candidate.seen, candidate.kept)
    assert found.clean[len(candidate.kept) :] == pytest.approx(candidate.clean[hidden], abs=1e-9)
    assert not np.array_equal(found.clean[: len(candidate.kept)], candidate.clean[candidate.kept])


def test_with_everything_known_the_clouds_are_those_of_the_truth(drill):
    candidate = candidate_of(drill, *ALL_CAUSES)
    found = told(candidate, NOISE, OVERLAP)
    for present in SUBSETS:
        own, true = (np.sort(each.observed(present), axis=0) for each in (found, candidate))
        assert own == pytest.approx(true, abs=1e-9)


def test_a_cause_that_is_known_to_be_absent_is_not_removed(drill):
    candidate = candidate_of(drill, "pose")
    found = told(candidate, NOISE, OVERLAP)
    assert found.applied.tolist() == [False, True, False]
    assert found.observed(()) == pytest.approx(candidate.observed((POSE,)), abs=1e-9)


def test_objects_or_settings_of_another_draw_are_refused(four, some):
    for asked_of, truth in (
        (some, replace(TRUTH, points=(200, 300))),
        (replace(some, candidate=some.candidate + 1), TRUTH),
    ):
        with pytest.raises(InputError, match="is not reproduced by these settings"):
            ask_oracles(four, asked_of, "four", 100, SETTINGS, truth)
