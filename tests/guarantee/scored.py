"""Scores of models that were trained on one part of twelve families each."""

import numpy as np

from gpca.causes.dataset import LABELS
from gpca.guarantee.answers import Scored
from gpca.guarantee.guarantee import SEVERAL, STATES

FAMILIES = np.array([f"family{number:02d}" for number in range(12)])


def random_scored(model="part 0", seed=0, samples=20, families=FAMILIES, source=None, skill=2.0):
    """Samples of each family; the model was trained on every third family, by the number in its name."""
    random = np.random.default_rng(seed)
    family = np.repeat(families, samples)
    n = len(family)
    number = random.integers(len(STATES), size=n)
    first, second = random.integers(1, 4, size=n), random.integers(1, 4, size=n)
    worth = np.zeros((n, len(LABELS)))
    for row, state in enumerate(number):
        chosen = [state] if STATES[state] != SEVERAL else [first[row], second[row]]
        worth[row, chosen] = skill
    worth += random.normal(size=worth.shape) + 0.5 * random.normal(size=len(families)).repeat(samples)[:, None]
    scores = np.exp(worth)
    part = np.array([list(FAMILIES).index(name) % 3 for name in family])
    return Scored(
        model=np.full(n, model),
        source=np.where(part == 1, "cups", "tools") if source is None else np.full(n, source),
        seed=random.integers(100, 103, size=n),
        sample=np.array([f"test {row}" for row in range(n)]),
        family=family,
        state=np.array(STATES)[number],
        seen=part == int(model.split()[-1]),
        severity=random.random(n),
        weight=np.ones(n),
        scores=scores / scores.sum(axis=1, keepdims=True),
    )


def scored_samples():
    """Three models, and one that scored frames."""
    simulated = random_scored("frames 9", 3, 10)
    frames = random_scored("frames 9", 4, 5, source="real_rgbd", skill=0.5)
    return Scored.joined([*(random_scored(f"part {part}", part) for part in range(3)), simulated, frames])
