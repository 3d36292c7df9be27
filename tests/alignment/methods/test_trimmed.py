from itertools import combinations, product

import numpy as np
import pytest

from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.registry import make_method
from gpca.alignment.rigid import exp, inverse, transform

from .pairs import clouds


def brute_force(source, target, kept):
    """The pose and the sum of least squares over all choices of `kept` source points and all their target points."""
    chosen = np.array(list(combinations(range(len(source)), kept)))
    assigned = np.array(list(product(range(len(target)), repeat=kept)))
    best = np.inf, None
    for rows in chosen:
        p = source[rows] - source[rows].mean(axis=0)
        q_n = target[assigned] - target[assigned].mean(axis=1, keepdims=True)
        u, _, vt = np.linalg.svd(np.einsum("nki,kj->nij", q_n, p))
        u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
        R_n = u @ vt
        squares_n = np.square(q_n - np.einsum("nij,kj->nki", R_n, p)).sum(axis=(1, 2))
        n = squares_n.argmin()
        if squares_n[n] < best[0]:
            T = np.eye(4)
            T[:3, :3] = R_n[n]
            T[:3, 3] = target[assigned[n]].mean(axis=0) - R_n[n] @ source[rows].mean(axis=0)
            best = squares_n[n], T
    return best


@pytest.mark.parametrize("seed", range(4))
def test_on_small_clouds_it_finds_the_least_of_all_choices(seed):
    random = np.random.default_rng(seed)
    target = random.uniform(-0.5, 0.5, size=(6, 3))
    T_true = exp(random.normal(scale=0.03, size=(1, 6)))[0]
    source = transform(inverse(T_true), target) + random.normal(scale=0.005, size=(6, 3))
    source[4:] += random.choice([-0.25, 0.25], size=(2, 3))  # what the target does not have
    least, T = brute_force(source, target, 4)
    outcome = make_method("trimmed", {"overlap": 4 / 6})(Pair(source, target))
    np.testing.assert_allclose(outcome.T_target_source, T, atol=1e-9)
    moved = transform(outcome.T_target_source, source)
    squares = np.sort(np.square(moved[:, None] - target).sum(axis=2).min(axis=1))[:4].sum()
    assert squares == pytest.approx(least)


def test_it_finds_how_much_of_the_source_overlaps(objects):
    """Half of the target is missing: what has no counterpart draws plain least squares aside."""
    source, target, _, _ = clouds(objects, 0, points=300)
    target = target[target[:, 2] < 0.02]
    pair = Pair(source, target, exp(np.array([[0.05, 0.05, 0.05, 0.03, 0.0, 0.03]]))[0])
    errors = [
        np.abs(make_method("trimmed", settings)(pair).T_target_source - np.eye(4)).max()
        for settings in ({}, {"overlap": 0.55}, {"overlap": 1.0})
    ]
    assert 2 * max(errors[:2]) < errors[2]
