"""Learning from more and more registrations of four objects."""

import numpy as np
import pytest

from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import LABELS
from gpca.causes.descriptors import QUICK, LabeledSamples, describe_all
from gpca.causes.drawing import draw_further
from gpca.causes.judged import CEILING
from gpca.causes.settings import CauseSettings, DescriptorSettings
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.steps.learning_curve import CURVE_COLUMNS, LEARNERS, CurveSettings, describe, labeled_samples, learning_curve
from tests.conftest import FEW_CAUSES

SETTINGS = CurveSettings(
    further=12, sizes=(20, 24), orders=2, classifier=GPCSettings(learning_rate=0.1, iterations=5, inducing=6, draws=50)
)


@pytest.fixture(scope="module")
def further(four):
    return draw_further(four, "four", 100, CauseSettings(**FEW_CAUSES), 0, 12)


@pytest.fixture(scope="module")
def samples(causes, further):
    icp = ICPSettings()
    described = describe(causes, icp)
    labeled = causes.rows("train")[np.isin(described.concept[causes.rows("train")], LABELS)]
    more = describe(further, icp)
    pool = LabeledSamples.joined([described.subset(labeled), more, more])  # enough for the sizes
    return pool, described.subset(causes.rows("test"))


def test_further_samples_are_labeled_of_all_objects_and_new(causes, further):
    names = causes.registrations.object_name
    assert set(further.registrations.object_name) <= set(names) > set(names[causes.rows("train")])
    assert set(further.registrations.split) == {"train"} and not len(further.truth_again)
    assert np.isin(describe(further, ICPSettings()).concept, LABELS).all()
    assert not set(further.registrations.severity_noise[further.applied[:, 0]]) & set(
        causes.registrations.severity_noise
    )


def test_cheap_descriptors_are_those_of_the_explainers(causes):
    described, _, _ = describe_all(
        causes, "four", 100, DescriptorSettings(starts=1, restarts=1, icp_points=64), ICPSettings()
    )
    own = describe(causes, ICPSettings())
    for name in QUICK:
        assert np.array_equal(getattr(own, name), described.groups[name])


def test_every_learner_has_a_row_of_each_size_and_order_beside_the_truth(samples, causes):
    curve = learning_curve(*samples, causes.subset(causes.rows("test")), SETTINGS, "four", 100)
    assert tuple(curve.columns) == CURVE_COLUMNS
    counts = curve.groupby("learner").size()
    assert counts[CEILING] == 1 and all(counts[name] == 4 for name in LEARNERS)
    assert curve["balanced_accuracy"].between(0, 1).all() and (curve["regret"] >= 0).all()


def test_more_samples_than_there_are_cannot_be_learned_from(samples, causes):
    pool, tested = samples
    truth = causes.subset(causes.rows("test"))
    fewer = learning_curve(pool.subset(np.arange(20)), tested, truth, SETTINGS, "four", 100)
    assert set(fewer["samples"]) == {0, 20}
    with pytest.raises(InputError, match="are fewer than the least size, 20; raise"):
        learning_curve(pool.subset(np.arange(19)), tested, truth, SETTINGS, "four", 100)
    alike = pool.subset(np.flatnonzero(pool.concept == pool.concept[0])[np.zeros(20, int)])
    with pytest.raises(InputError, match="cover fewer than two concepts"):
        learning_curve(alike, tested, truth, SETTINGS, "four", 100)


def test_chunks_are_even_and_borderline_samples_have_no_label():
    assert CurveSettings(further=4700, chunk=600).chunks() == [588] * 4 + [587] * 4
    assert CurveSettings(further=250, chunk=600).chunks() == [250]
    shares = {"nominal": 0.3, "borderline": 0.16, "noise": 0.18, "pose": 0.18, "overlap": 0.18, "geometry": 0}
    assert labeled_samples({"train": 450, "shares": shares}) == 378
