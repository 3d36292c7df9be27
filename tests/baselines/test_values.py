from dataclasses import replace

import numpy as np
import pytest

from baselines.sensitivity import ONE_AT_A_TIME, single_drops
from baselines.shap_kl import ALL_CORNERS
from baselines.values import WORTHS, KnobValues
from gpca.errors import InputError
from gpca.explainers.registry import explainer_entry
from gpca.pairs.perturbation import CONCEPTS

SCALED = ("shap_removal", "sa_local_removal")
LEARNED = ("shap_supervised", "sa_supervised")
CHARGED = {"shap_removal": ALL_CORNERS, "shap_supervised": ALL_CORNERS}
CHARGED |= {"sa_local_removal": ONE_AT_A_TIME, "sa_supervised": ONE_AT_A_TIME}


@pytest.fixture(scope="module")
def attached(registrations):
    """With the 8 corners of design ``removal``: the remedy of the true concept lowers both worths more than it usually
    does, but the second remedy lowers them most in every pair.
    """
    n = len(registrations)
    random = np.random.default_rng(0)
    true_S_3 = registrations.concept[:, None] == np.array(CONCEPTS)
    usual_3, more_3 = np.array([0.5, 9.0, 1.0]), np.array([1.0, 4.0, 0.3])
    gain_S_3 = usual_3 + more_3 * (true_S_3 + 0.1 * random.normal(size=(n, 3)))
    present_8_3 = (np.arange(8)[:, None] >> np.arange(3)) & 1
    worth_S_8 = 20 - gain_S_3 @ present_8_3.T
    calls_S_8 = np.arange(n)[:, None] + 2 ** np.arange(8)
    arrays = {"uncertainty": worth_S_8, "residual": worth_S_8 / 100 - 3, "icp_calls": calls_S_8}
    return replace(registrations, attached=arrays | {"icp_seconds": 1e-3 * calls_S_8, "seconds": 2e-3 * calls_S_8})


def fitted(name, registrations, **settings):
    explainer = explainer_entry(name).make("tiny", 0, **settings)
    explainer.fit(registrations.subset(registrations.rows("train")))
    return explainer


def with_arrays(registrations, **arrays):
    return replace(registrations, attached={**registrations.attached, **arrays})


def accuracy(attribution, registrations):
    test = registrations.rows("test")
    return np.mean(attribution.predicted_N[test] == registrations.concept[test])


@pytest.mark.parametrize("worth", WORTHS)
@pytest.mark.parametrize("name", SCALED)
def test_a_remedy_that_helps_every_pair_most_is_not_always_named_and_the_chosen_worth_counts(name, worth, attached):
    plain = single_drops(-attached.attached[worth])
    assert (plain.argmax(axis=1) == 1).all()
    attribution = fitted(name, attached, worth=worth).explain(attached.without_labels())
    assert accuracy(attribution, attached) == 1
    other = with_arrays(attached, residual=np.random.default_rng(1).normal(size=(len(attached), 8)))
    after = fitted(name, other, worth=worth).explain(other).scores_N_C
    assert np.array_equal(attribution.scores_N_C, after) is (worth == "uncertainty")


def test_scores_count_from_the_training_mean_in_training_deviations(attached):
    drops = single_drops(-attached.attached["uncertainty"])
    train = drops[attached.rows("train")]
    scores = fitted("sa_local_removal", attached).explain(attached).scores_N_C
    assert scores == pytest.approx((drops - train.mean(axis=0)) / train.std(axis=0))


@pytest.mark.parametrize("name", SCALED)
def test_test_rows_do_not_touch_the_scaling(name, attached):
    train, test = attached.rows("train"), attached.rows("test")
    scores = fitted(name, attached).explain(attached).scores_N_C
    uncertainty = attached.attached["uncertainty"].copy()
    uncertainty[test] = 1000 * uncertainty[test][:, ::-1]
    changed = with_arrays(attached, uncertainty=uncertainty)
    scores_changed = fitted(name, changed).explain(changed).scores_N_C
    assert np.array_equal(scores_changed[train], scores[train])
    assert not np.isclose(scores_changed[test], scores[test]).any(axis=1).all()


@pytest.mark.parametrize("name", LEARNED)
def test_learning_separates_the_concepts_by_either_worth(name, attached):
    nothing = np.random.default_rng(1).normal(size=(len(attached), 8))
    for arrays in ({}, {"residual": nothing}, {"uncertainty": nothing}):
        registrations = with_arrays(attached, **arrays)
        attribution = fitted(name, registrations).explain(registrations.without_labels())
        assert attribution.scores_N_C.sum(axis=1) == pytest.approx(1)
        assert accuracy(attribution, registrations) > 0.9
    neither = with_arrays(attached, uncertainty=nothing, residual=nothing)
    assert accuracy(fitted(name, neither).explain(neither), neither) < 0.8


@pytest.mark.parametrize("name", LEARNED)
def test_a_concept_absent_from_training_scores_0_and_one_alone_is_refused(name, attached):
    for absent in CONCEPTS:
        seen = attached.concept != absent
        attribution = fitted(name, attached.subset(np.flatnonzero(seen))).explain(attached)
        assert (attribution.scores_N_C[:, CONCEPTS.index(absent)] == 0).all()
        assert np.mean(attribution.predicted_N[seen] == attached.concept[seen]) > 0.9
    with pytest.raises(InputError, match="training registrations: cover fewer than two concepts"):
        fitted(name, attached.subset(np.flatnonzero(attached.concept == "noise")))


@pytest.mark.parametrize("name", (*SCALED, *LEARNED))
def test_only_the_corners_that_it_needs_are_charged(name, attached):
    attribution = fitted(name, attached).explain(attached)
    calls_N = attached.attached["icp_calls"][:, CHARGED[name]].sum(axis=1)
    assert np.array_equal(attribution.icp_calls_N, calls_N)
    assert attribution.icp_seconds_N == pytest.approx(1e-3 * calls_N)
    assert (attribution.seconds_N > 2e-3 * calls_N).all()


def test_a_charge_is_that_of_its_conditions_and_the_time_since_the_start_shared_out(attached, monkeypatch):
    n, times = len(attached), iter([100.0, 154.0])
    scores = np.random.default_rng(0).normal(size=(n, 3))
    monkeypatch.setattr("gpca.explainers.interface.perf_counter", lambda: next(times))
    attribution = KnobValues(lambda _: scores, [1, 3], "tiny", 0).explain(attached)
    assert attribution.icp_calls_N.tolist() == [2 * i + 2 + 8 for i in range(n)]
    assert attribution.icp_seconds_N == pytest.approx(1e-3 * attribution.icp_calls_N)
    own = attribution.seconds_N - 2e-3 * attribution.icp_calls_N
    assert own == pytest.approx(54.0 / n)
    assert attribution.concepts == CONCEPTS
    assert np.array_equal(attribution.scores_N_C, scores)


def test_equal_scores_name_no_concept_but_two_equal_largest_do_and_corners_are_the_first_conditions(attached):
    scores = np.tile([[1.0, 2.0, 3.0]], (len(attached), 1))
    scores[4], scores[9], scores[11] = 0.0, -2.5, [2.0, 2.0, 0.0]
    attribution = KnobValues(lambda _: scores, [0], "tiny", 0).explain(attached)
    assert np.flatnonzero(attribution.abstained_N).tolist() == [4, 9]
    assert attribution.predicted_N[[4, 9, 11]].tolist() == ["", "", CONCEPTS[0]]
    eleven = np.arange(len(attached) * 11, dtype=float).reshape(-1, 11)
    read = KnobValues(lambda worth: -worth, None, "tiny", 0).remedy_values
    assert np.array_equal(read(with_arrays(attached, uncertainty=eleven), "uncertainty"), eleven[:, :8])
