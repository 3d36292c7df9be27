from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import spearmanr
from sklearn.metrics import average_precision_score, balanced_accuracy_score, roc_auc_score

from gpca.causes.dataset import LABELS
from gpca.causes.truth import BORDERLINE, NOMINAL
from gpca.experiments.diagnosis.measures import MEASURES, OF_ALARM, OF_FAILED, RECALL, counted, measure


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
    left = judged.error[failed, 7 - (1 << first)]
    assert found["deletion_gain"] == pytest.approx(np.average(1 - left / judged.error[failed, 7], weights=weight))


def test_false_alarms_are_counted_where_nine_of_ten_failures_are_found(judged):
    known = judged.label != BORDERLINE
    failed, alarm = (judged.label != NOMINAL)[known], judged.alarm[known]
    threshold = max(t for t in alarm if (alarm[failed] >= t).mean() >= RECALL)
    assert one(judged)["false_alarm_rate"] == pytest.approx((alarm[~failed] >= threshold).mean())


def test_the_score_of_nominal_is_calibrated_where_it_comes_true_as_often_as_it_says(judged):
    nominal = judged.label == NOMINAL
    assert one(replace(judged, nominal=nominal.astype(float)))["nominal_calibration"] == 0
    assert one(replace(judged, nominal=1.0 - nominal))["nominal_calibration"] == 1


def test_a_gate_names_no_cause_and_has_the_measures_of_an_alarm_alone(judged):
    gate = replace(judged, named=np.full(len(judged), ""))
    assert set(one(gate)) == set(OF_ALARM)


def test_samples_between_the_limits_count_nowhere(judged):
    known = judged.label != BORDERLINE
    changed = np.where(known, judged.alarm, 99.0)
    assert one(replace(judged, alarm=changed)) == pytest.approx(one(judged))


def test_without_failures_or_without_nominal_samples_nothing_is_told_apart(judged):
    for label in (NOMINAL, "noise"):
        of_one = replace(judged, label=np.full(len(judged), label))
        assert np.isnan(one(of_one)["auroc_failed"])
