"""How a model learns from measured causes: the threshold on objects that it has not seen, then all of them."""

import numpy as np
import pytest
from scipy import stats

from gpca.causes.settings import CauseSettings
from gpca.causes.shapley import ALL
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.features.dataset import WIDTHS, Descriptors
from gpca.features.settings import DescriptorSettings
from gpca.model.learning import Lessons, fit_error, joined, learn, threshold_of

SETTINGS = GPCSettings(learning_rate=0.1, iterations=40, inducing=8, draws=200)
FEATURES = sum(WIDTHS.values())


def lessons(n, seed, shift=3.0):
    random = np.random.default_rng(seed)
    failed_N = np.arange(n) % 3 > 0
    features_N_F = random.normal(size=(n, FEATURES)) + shift * failed_N[:, None]
    label_N = np.where(failed_N, np.where(np.arange(n) % 3 == 1, "noise", "pose"), "nominal")
    return Lessons(
        features_N_F,
        label_N,
        np.stack([label_N == concept for concept in ("noise", "pose", "overlap")], axis=1) | failed_N[:, None],
        np.where(failed_N, 0.2, 0.01),
        np.arange(n) >= n // 2,
    )


def test_lessons_are_those_of_the_truth(causes):
    random = np.random.default_rng(0)
    groups = {name: random.normal(size=(len(causes), width)) for name, width in WIDTHS.items()}
    descriptors = Descriptors(
        causes.registrations.sample, causes.registrations.split, groups, causes.registrations.axes
    )
    found = Lessons.of(causes, descriptors)
    assert found.features_N_F.shape == (len(causes), FEATURES)
    np.testing.assert_array_equal(found.error_N, causes.truth.error[:, ALL])
    np.testing.assert_array_equal(found.unseen_N, causes.registrations.split == "test")
    both = joined([found, found.subset(found.unseen_N)])
    assert len(both.label_N) == len(causes) + found.unseen_N.sum()


@pytest.mark.parametrize("share", [0.0, 0.05, 0.5])
def test_at_most_the_share_of_nominal_samples_reaches_the_threshold(share):
    failure_N = np.random.default_rng(1).uniform(size=200)
    threshold = threshold_of(failure_N, share)
    assert (failure_N >= threshold).mean() <= share < (failure_N >= threshold).mean() + 1 / 200


def test_the_error_is_that_of_scikit_learn_and_rises_with_what_it_comes_from():
    random = np.random.default_rng(2)
    inputs_N_F = random.normal(size=(300, 4))
    error_N = np.exp(inputs_N_F[:, 0] - 3 + 0.1 * random.normal(size=300))
    weights = fit_error(inputs_N_F, error_N)
    told_N = inputs_N_F @ weights[:-1] + weights[-1]
    assert stats.spearmanr(told_N, error_N).statistic > 0.95
    assert np.abs(told_N - np.log(error_N)).mean() < 0.15


def test_failures_are_told_from_what_is_fine_and_the_uncertainty_is_of_unseen_failures():
    given = lessons(60, 0)
    causes, descriptors = CauseSettings(), DescriptorSettings()
    diagnoser, bald_N = learn(given, SETTINGS, causes, descriptors, 0.05, "tiny", 0)
    assert len(bald_N) == (given.unseen_N & (given.label_N != "nominal")).sum()
    new = lessons(30, 1)
    classifier = diagnoser.classifier
    alarm_N = classifier.judge(classifier.normalized(new.features_N_F)).failure_N >= diagnoser.threshold
    np.testing.assert_array_equal(alarm_N, new.label_N != "nominal")
    assert diagnoser.points == causes.points[1]
    assert diagnoser.runs.starts == causes.starts


def test_without_a_nominal_registration_of_unseen_objects_one_line_says_so():
    given = lessons(30, 0)
    failures = given.subset(~given.unseen_N | (given.label_N != "nominal"))
    with pytest.raises(InputError, match=r"model: has no nominal registration of unseen objects; raise causes\.test"):
        learn(failures, SETTINGS, CauseSettings(), DescriptorSettings(), 0.05, "tiny", 0)
