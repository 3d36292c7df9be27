import numpy as np
import pytest

from baselines.analytical import AnalyticalGPC
from gpca.explainers.registry import explainer_entry

QUICK = {"learning_rate": 0.1, "iterations": 60, "inducing": 16, "draws": 200, "shape_points": 64}
NAMES = ("analytical_gpc", "analytical_gpc_no_counts")


def test_it_names_the_concept_and_needs_no_label_and_no_other_sample(registrations):
    explainer = explainer_entry("analytical_gpc").make("tiny", 0, **QUICK)
    explainer.fit(registrations.subset(registrations.rows("train")))
    attribution = explainer.explain(registrations.without_labels())
    assert np.mean(attribution.predicted_N == registrations.concept) > 0.8
    assert (attribution.variances_N_C > 0).all()
    assert (attribution.seconds_N > 0).all()
    rows = np.array([7, 50, 3])
    part = explainer.explain(registrations.subset(rows))
    assert part.scores_N_C == pytest.approx(attribution.scores_N_C[rows], abs=1e-6)


def test_the_point_count_ratio_is_the_last_feature_of_the_one_and_none_of_the_other(registrations):
    with_counts, without = (explainer_entry(name).make("tiny", 0, **QUICK)._inputs(registrations) for name in NAMES)
    ratio_S = np.diff(registrations.offsets) / np.diff(registrations.target_offsets)
    assert np.array_equal(with_counts[:, -1], ratio_S)
    assert np.array_equal(with_counts[:, :-1], without)
    assert np.array_equal(without[:, 0], registrations.inlier_rmse)
    rows = np.array([50, 7, 20])  # the points drawn are named by split and sample
    assert np.array_equal(AnalyticalGPC("tiny", 0, **QUICK)._inputs(registrations.subset(rows)), with_counts[rows])
    assert not np.array_equal(AnalyticalGPC("tiny", 1, **QUICK)._inputs(registrations), with_counts)
