"""Test samples that an explainer judged at random, but better than by chance."""

import numpy as np
import pytest

from gpca.causes.dataset import LABELS
from gpca.causes.truth import BORDERLINE, FAILED, NOMINAL
from gpca.experiments.diagnosis.judged import Judged


def random_judged(n=60, seed=0, skill=1.0):
    random = np.random.default_rng(seed)
    label = random.choice([*LABELS, BORDERLINE], size=n)
    error = random.uniform(0.03, 0.4, size=(n, 8))
    error[:, 0] = 0.01
    phi = random.uniform(-0.01, 0.2, size=(n, 3))
    for i, concept in enumerate(LABELS[1:]):
        phi[label == concept, i] = 0.3
    scores = random.dirichlet(np.ones(4), size=n)
    for i, name in enumerate(LABELS):
        scores[label == name, i] += skill
    scores = np.round(scores / scores.sum(axis=1, keepdims=True), 2)  # some of them equal
    return Judged(
        label=label,
        instance=random.choice(["cup", "can", "drill"], size=n),
        seed=random.choice([100, 101], size=n),
        error=error,
        phi=phi,
        causes=phi > 0.01,
        tied=phi >= phi.max(axis=1, keepdims=True) - 0.01,
        margin=np.diff(np.sort(phi, axis=1), axis=1)[:, -1],
        shown=random.choice([NOMINAL, BORDERLINE, FAILED], size=n),
        symmetric=random.random(n) < 0.3,
        alarm=1 - scores[:, 0],
        scores=scores[:, 1:],
        named=np.array(LABELS)[scores.argmax(axis=1)],
        nominal=scores[:, 0],
    )


@pytest.fixture
def judged():
    return random_judged()
