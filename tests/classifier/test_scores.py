import dataclasses

import numpy as np
import pytest

from gpca.classifier.scores import Attribution, entropy, summarize_draws, summarize_marginals
from gpca.pairs.perturbation import CONCEPTS


def attribution(n, seed=0, **changed):
    random = np.random.default_rng(seed)
    scores, variances, bald = summarize_draws(random.normal(size=(50, n, 3)))
    zeros = np.zeros(n)
    made = Attribution(CONCEPTS, scores, variances, bald, zeros.astype(bool), zeros.astype(int), zeros, zeros)
    return dataclasses.replace(made, **changed)


def test_draws_are_summarized_as_the_paper_writes():
    logits_M_N_C = np.random.default_rng(0).normal(scale=3, size=(40, 5, 3))
    scores, variances, bald = summarize_draws(logits_M_N_C)
    for n in range(5):
        draws = []
        for m in range(40):  # Eq. 2
            exponentials = [np.exp(f) for f in logits_M_N_C[m, n]]
            draws.append([e / sum(exponentials) for e in exponentials])
        mean = [sum(draw[c] for draw in draws) / 40 for c in range(3)]  # Eq. 4
        variance = [sum((draw[c] - mean[c]) ** 2 for draw in draws) / 40 for c in range(3)]  # Eq. 5
        entropy_of_mean = -sum(p * np.log(p) for p in mean)
        mean_of_entropy = sum(-sum(p * np.log(p) for p in draw) for draw in draws) / 40
        assert scores[n] == pytest.approx(mean)
        assert variances[n] == pytest.approx(variance)
        assert bald[n] == pytest.approx(entropy_of_mean - mean_of_entropy)  # Eq. 7


def test_draws_that_disagree_have_bald_of_log_c_whatever_is_added_to_all():
    scores, variances, bald = summarize_draws(1000.0 * np.eye(3)[np.arange(60) % 3][:, None])
    assert scores[0] == pytest.approx(1 / 3)
    assert variances[0] == pytest.approx(1 / 3 * 2 / 3)
    assert bald[0] == pytest.approx(np.log(3))
    logits = np.random.default_rng(0).normal(size=(10, 4, 3))
    for one, other in zip(summarize_draws(logits), summarize_draws(logits + 1e4), strict=True):
        assert np.allclose(one, other, atol=1e-9)


def test_entropy_is_in_nats_and_the_largest_score_names_the_concept():
    assert entropy(np.array([[1.0, 0, 0], [0.5, 0.5, 0], [1 / 3] * 3])) == pytest.approx([0, np.log(2), np.log(3)])
    made = attribution(2, scores_N_C=np.array([[2.0, 2.0, 0.0], [5.0, 0.0, 0.0]]))
    assert made.entropy_N == pytest.approx([np.log(2), 0])
    scores = np.array([[0.2, 0.3, 0.5], [0.4, 0.4, 0.2], [0.2, 0.4, 0.4], [1 / 3, 1 / 3, 1 / 3], [0.1, 0.8, 0.1]])
    made = attribution(5, scores_N_C=scores, abstained_N=np.array([False] * 4 + [True]))
    assert made.predicted_N.tolist() == ["overlap", "noise", "pose", "noise", ""]


def marginals(n, seed=0):
    random = np.random.default_rng(seed)
    return random.normal(scale=2, size=(n, 3)), random.uniform(0, 3, size=(n, 3)), random.normal(size=(50, 3))


@pytest.mark.parametrize("block", [1, 7, 1000])
def test_marginals_are_summarized_as_the_draws_they_stand_for(block):
    mean, deviation, normal = marginals(20)
    draws = mean + deviation * normal[:, None]
    for of_draws, of_marginals in zip(
        summarize_draws(draws), summarize_marginals(mean, deviation, normal, block), strict=True
    ):
        assert of_marginals.shape == of_draws.shape
        assert np.abs(of_marginals - of_draws).max() < 1e-12


def test_marginals_without_deviation_have_the_softmax_of_their_mean_and_none_an_empty_summary():
    shapes = [summary.shape for summary in summarize_marginals(*marginals(0))]
    assert shapes == [(0, 3), (0, 3), (0,)]
    mean, deviation, normal = marginals(20)
    scores, variances, bald = summarize_marginals(mean, 0 * deviation, normal)
    assert scores == pytest.approx(np.exp(mean) / np.exp(mean).sum(axis=1, keepdims=True))
    assert np.abs(variances).max() < 1e-12
    assert np.abs(bald).max() < 1e-12
