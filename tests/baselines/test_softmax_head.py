from dataclasses import replace

import numpy as np
import pytest

from gpca.explainers.registry import explainer_entry
from gpca.pairs.perturbation import CONCEPTS


def explain(registrations, logits):
    entry = explainer_entry("softmax_head")
    assert entry.reads == "embeddings"
    return entry.make("tiny", 0).explain(replace(registrations, attached={"head_logits": logits}))


def test_scores_are_the_softmax_of_the_logits_even_of_large_ones(registrations):
    logits = np.random.default_rng(0).normal(scale=3, size=(len(registrations), 3))
    logits[0] = [1000.0, 1000.0, 0.0]
    attribution = explain(registrations, logits)
    weights = np.exp(logits[1:])
    assert attribution.scores_N_C[0] == pytest.approx([0.5, 0.5, 0.0])
    assert attribution.scores_N_C[1:] == pytest.approx(weights / weights.sum(axis=1, keepdims=True))
    assert attribution.predicted_N.tolist() == np.array(CONCEPTS)[logits.argmax(axis=1)].tolist()
    assert attribution.icp_calls_N.tolist() == [0] * len(registrations)
    assert (attribution.seconds_N > 0).all()
