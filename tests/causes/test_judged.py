from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import spearmanr
from sklearn.metrics import average_precision_score, balanced_accuracy_score, roc_auc_score

from gpca.causes.dataset import LABELS
from gpca.causes.judged import MEASURES, RECALL, counted, decision_measures, measure
from gpca.causes.truth import BORDERLINE, FAILED, NOMINAL
from tests.judged import random_judged

OF_FAILED = ("regret", "tied_accuracy", "dominant_accuracy", "deletion_gain")
OF_FAILED += ("spearman_attribution", "cosine_attribution")
OF_SHOWN = ("state_accuracy_shown", "auroc_failed_shown")
OF_ALARM = ("auroc_failed", "auprc_failed", "false_alarm_rate", "nominal_calibration")


@pytest.fixture
def judged():
    return random_judged()


def one(samples, weights=None):
    weights = np.ones(len(samples)) if weights is None else weights
    return {name: values[0] for name, values in measure(samples, weights[None]).items()}


@pytest.fixture(params=[False, True])
def weights(request, judged):
    """Ones, or how often a bootstrap drew each sample, some of them never."""
    if request.param:
        return np.random.default_rng(1).integers(0, 4, size=len(judged)).astype(float)
    return np.ones(len(judged))


@pytest.mark.parametrize("metric", MEASURES)
def test_a_measure_depends_on_as_many_samples_as_are_counted(judged, metric):
    if metric in OF_SHOWN:
        assert counted(judged, metric).sum() == (judged.shown != BORDERLINE).sum()
        return
    kinds = {"failed": ~np.isin(judged.label, [NOMINAL, BORDERLINE]), "nominal": judged.label == NOMINAL}
    wanted = ["failed"] if metric in OF_FAILED else ["nominal"] if metric == "false_alarm_rate" else list(kinds)
    assert counted(judged, metric).sum() == sum(kinds[kind].sum() for kind in wanted)
    if metric in OF_FAILED:  # the others need no sample: their weights may be anything
        alone = np.where(kinds["failed"], 1.0, 0.0)
        assert one(judged, alone)[metric] == pytest.approx(one(judged)[metric])


def test_what_is_known_to_scikit_learn_agrees_with_it(judged, weights):
    found = one(judged, weights)
    assert set(found) == set(MEASURES)
    known = judged.label != BORDERLINE
    failed, alarm, weight = (judged.label != NOMINAL)[known], judged.alarm[known], weights[known]
    assert found["auroc_failed"] == pytest.approx(roc_auc_score(failed, alarm, sample_weight=weight))
    assert found["auprc_failed"] == pytest.approx(average_precision_score(failed, alarm, sample_weight=weight))
    balanced = balanced_accuracy_score(judged.label[known], judged.named[known], sample_weight=weight)
    assert found["balanced_accuracy"] == pytest.approx(balanced)
    precisions = [
        average_precision_score(judged.causes[known, i], judged.scores[known, i], sample_weight=weight)
        for i in range(3)
    ]
    assert found["average_precision"] == pytest.approx(np.mean(precisions))


def test_the_others_are_what_they_say(judged, weights):
    found = one(judged, weights)
    failed = ~np.isin(judged.label, (BORDERLINE, NOMINAL))
    weight = weights[failed]
    first = judged.scores[failed].argmax(axis=1)
    right = np.array(LABELS[1:])[first] == judged.label[failed]
    assert found["dominant_accuracy"] == pytest.approx(np.average(right, weights=weight))
    ranks = [spearmanr(a, b).statistic for a, b in zip(judged.scores[failed], judged.phi[failed], strict=True)]
    assert found["spearman_attribution"] == pytest.approx(np.average(np.nan_to_num(ranks), weights=weight))
    near = judged.phi[failed].max(axis=1) - judged.phi[failed][np.arange(failed.sum()), first] <= 0.01
    assert found["tied_accuracy"] == pytest.approx(np.average(near, weights=weight))
    left = judged.error[failed, 7 - (1 << first)]
    assert found["deletion_gain"] == pytest.approx(np.average(1 - left / judged.error[failed, 7], weights=weight))


@pytest.fixture
def failure(judged):
    """One failure of 0.4 d, of which removing noise takes 0.1 away, pose 0.3, and overlap adds 0.04."""
    error_8 = np.full(8, 0.2)
    error_8[7], error_8[6], error_8[5], error_8[3] = 0.4, 0.3, 0.1, 0.44
    row = judged.subset(np.flatnonzero(judged.label == "pose")[:1])
    return replace(row, error=error_8[None], tied=np.array([[False, True, False]]))


@pytest.mark.parametrize(
    ("named", "regret", "right"),
    [("pose", 0.0, 1), ("noise", 0.5, 0), ("overlap", 0.85, 0), (NOMINAL, 0.75, 0), ("", 0.75, 0)],
)
def test_regret_is_what_the_named_cause_leaves_of_what_the_best_one_takes_away(failure, named, regret, right):
    found = decision_measures(replace(failure, named=np.array([named])), np.ones((1, 1)))
    assert found["regret"] == pytest.approx(regret) and found["named_right"] == right


def test_the_registration_that_is_shown_is_judged_by_its_own_state(judged):
    by_own = replace(judged, alarm=(judged.shown == FAILED).astype(float))
    assert one(by_own)["auroc_failed_shown"] == 1 > one(by_own)["auroc_failed"]
    always = replace(judged, nominal=np.full(len(judged), 2.0))
    assert one(always)["state_accuracy"] == one(always)["state_accuracy_shown"] == 0.5


def test_false_alarms_and_the_calibration_of_nominal_are_those_of_their_definitions(judged):
    known = judged.label != BORDERLINE
    failed, alarm = (judged.label != NOMINAL)[known], judged.alarm[known]
    threshold = max(t for t in alarm if (alarm[failed] >= t).mean() >= RECALL)
    assert one(judged)["false_alarm_rate"] == pytest.approx((alarm[~failed] >= threshold).mean())
    nominal = judged.label == NOMINAL
    assert one(replace(judged, nominal=nominal.astype(float)))["nominal_calibration"] == 0
    assert one(replace(judged, nominal=1.0 - nominal))["nominal_calibration"] == 1
    draws_B_N = np.vstack([np.ones(len(judged)), np.random.default_rng(1).integers(0, 3, size=(50, len(judged)))])
    value, *drawn_B = measure(judged, draws_B_N)["nominal_calibration"]
    assert np.mean(drawn_B) == pytest.approx(value)  # which repeated samples would inflate


def test_a_gate_has_the_measures_of_an_alarm_alone_and_samples_between_the_limits_none(judged):
    gate = replace(judged, named=np.full(len(judged), ""))
    assert set(one(gate)) == {*OF_ALARM, *OF_SHOWN, "state_accuracy"}
    known = judged.label != BORDERLINE
    changed = np.where(known, judged.alarm, 99.0)
    found, expected = one(replace(judged, alarm=changed)), one(judged)
    assert {name: found[name] for name in found if name not in OF_SHOWN} == pytest.approx(
        {name: expected[name] for name in expected if name not in OF_SHOWN}
    )
