"""CELLO-3D and the learned ensemble on examples of which it is known what a descriptor means."""

import numpy as np
import pytest

from gpca.rigid import adjoint, exp
from gpca.uncertainty.estimators import learned
from gpca.uncertainty.estimators.interface import Example, FailedEstimate, intrinsic_frame

from .cases import ellipsoid, registered

FRAME = intrinsic_frame(ellipsoid(1)[0])
SCALE_6 = np.array([1, 2, 3, 0.5, 1, 1.5]) * 0.02


def example(easy, seed):
    """Twists along the axes whose variance is ten times as large where the first four descriptors are near 1."""
    random = np.random.default_rng(seed)
    along_n_6 = random.normal(size=(30, 6)) * SCALE_6 * (1 if easy else 10) ** 0.5
    twists_n_6 = along_n_6 @ adjoint(FRAME).T
    descriptors = np.concatenate([(0 if easy else 1) + 0.1 * random.normal(size=4), random.normal(size=3)])
    return Example(descriptors, twists_n_6, np.zeros(6), FRAME)


EXAMPLES = [example(seed % 2 == 0, seed) for seed in range(60)]


def variances(estimate, easy):
    """What is estimated along the axes, of another pair of the kind."""
    descriptors = example(easy, 1000).descriptors
    covariance = estimate(registered(describe=lambda: descriptors))
    back = np.linalg.inv(adjoint(FRAME))
    return back @ covariance @ back.T


@pytest.mark.parametrize(("learn", "tolerance"), [(learned.learn_cello, 0.35), (learned.learn_ensemble, 0.6)])
def test_the_covariance_is_that_of_like_pairs(learn, tolerance):
    estimate = learn(EXAMPLES)
    for easy, factor in ((True, 1), (False, 10)):
        found = variances(estimate, easy)
        assert np.diag(found) == pytest.approx(factor * SCALE_6**2, rel=tolerance)
        assert found == pytest.approx(np.diag(np.diag(found)), abs=1e-9)


def test_networks_contradict_each_other_far_from_what_they_know():
    """Errors with a mean that follows a descriptor: beyond the examples nobody knows how it goes on."""
    random = np.random.default_rng(0)
    examples = []
    for x in random.uniform(-1, 1, 40):
        truth = np.array([0.1 * x, 0, 0, 0, 0.1 * x, 0])
        runs = 0.005 * random.normal(size=(13, 6))
        descriptors = np.concatenate([[x], 0.01 * random.normal(size=3)])
        examples.append(Example(descriptors, runs, adjoint(FRAME) @ truth, FRAME))
    estimate = learned.learn_ensemble(examples, hidden=16)
    known, unknown = (np.trace(estimate(registered(describe=lambda x=x: np.array([x, 0, 0, 0])))) for x in (0.0, 5.0))
    assert unknown > 3 * known


def test_an_error_is_the_truth_seen_from_each_run():
    runs, truth = 0.1 * np.random.default_rng(0).normal(size=(4, 6)), np.array([0.1, 0, 0.05, 0.02, 0, 0])
    found = learned._errors(Example(np.zeros(3), runs, truth, np.eye(4)))
    for error, run in zip(found, runs, strict=True):
        assert exp(error[None])[0] @ exp(run[None])[0] == pytest.approx(exp(truth[None])[0], abs=1e-12)
    assert learned._errors(Example(np.zeros(3), truth[None], truth, np.eye(4))) == pytest.approx(np.zeros((1, 6)))


def test_descriptors_that_say_nothing_are_not_learned_by_heart():
    """Each training pair is predicted by the others alone; by itself too, the metric would single it out."""
    random = np.random.default_rng(5)
    blind = [Example(random.normal(size=7), each.twists, each.true_twist, FRAME) for each in EXAMPLES]
    pooled = np.mean([learned.twists_along_axes(each.twists, FRAME).var(axis=0) for each in blind], axis=0)
    assert np.diag(variances(learned.learn_cello(blind), True)) == pytest.approx(pooled, rel=0.4)


@pytest.mark.parametrize("learn", [learned.learn_cello, learned.learn_ensemble])
def test_too_few_examples_and_a_pair_without_descriptors_are_failures(learn):
    with pytest.raises(FailedEstimate, match="7 registrations to learn from, not 8"):
        learn(EXAMPLES[:7])
    with pytest.raises(FailedEstimate, match="the pair has no descriptors"):
        learn(EXAMPLES[:8], steps=1)(registered())


@pytest.mark.parametrize("examples", [6, 8])
def test_of_fewer_examples_than_components_no_axis_is_kept_along_which_they_do_not_differ(examples):
    random = np.random.default_rng(0)
    reduce = learned.Reduction(random.normal(size=(examples, 20)), 16)
    another = reduce(random.normal(size=(5, 20)))
    assert another.shape[1] == examples - 1
    assert np.abs(another).max() < 10
