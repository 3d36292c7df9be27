from itertools import combinations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gpca.alignment.methods.teaser import gnc_rotation, largest_clique, solve, vote
from gpca.rigid import inverse, rigid_motion, rotate, rotation_angle_rad, transform

NOISE = 0.01


def correspondences(n, outliers, seed, noise=NOISE):
    """Points in a unit cube, their images under a random motion within the noise, and which of them are right."""
    random = np.random.default_rng(seed)
    T_true = rigid_motion(Rotation.random(random_state=seed).as_matrix(), random.uniform(-1, 1, 3))
    source = random.uniform(-0.5, 0.5, size=(n, 3))
    offsets = random.normal(size=(n, 3))
    offsets *= noise * random.uniform(size=(n, 1)) / np.linalg.norm(offsets, axis=1, keepdims=True)
    target = transform(T_true, source) + offsets
    wrong = random.permutation(n)[: round(outliers * n)]
    target[wrong] = transform(T_true, random.uniform(-0.5, 0.5, size=(len(wrong), 3)))
    return source, target, T_true, np.setdiff1d(np.arange(n), wrong)


def assert_near(T, T_true, rotation_rad, translation):
    error = T @ inverse(T_true)
    assert rotation_angle_rad(error) < rotation_rad
    assert np.linalg.norm(T[:3, 3] - T_true[:3, 3]) < translation


@pytest.mark.parametrize(("outliers", "n"), [(0.0, 50), (0.5, 100), (0.9, 200), (0.95, 400)])
@pytest.mark.parametrize("seed", range(4))
def test_most_correspondences_may_be_wrong(outliers, n, seed):
    source, target, T_true, right = correspondences(n, outliers, seed)
    T, inliers = solve(source, target, NOISE)
    assert_near(T, T_true, 0.03, 0.015)
    assert len(np.intersect1d(inliers, right)) >= 0.8 * len(right)
    assert len(np.setdiff1d(inliers, right)) <= 2


@pytest.mark.parametrize("seed", range(4))
def test_without_noise_the_pose_is_exact(seed):
    source, target, T_true, right = correspondences(200, 0.9, seed, noise=0)
    T, inliers = solve(source, target, 1e-6)
    assert_near(T, T_true, 1e-6, 1e-9)
    assert np.array_equal(inliers, right)
    assert solve(np.eye(3), 5 * np.eye(3), NOISE) is None  # no three agree
    assert solve(source[:0], target[:0], NOISE) is None


@pytest.mark.parametrize("seed", range(5))
def test_the_rotation_withstands_half_of_wrong_differences(seed):
    source, target, T_true, right = correspondences(60, 0.5, seed)
    target = target - T_true[:3, 3]
    R, weights = gnc_rotation(source, target, 1.5 * NOISE)
    assert rotation_angle_rad(rigid_motion(R) @ inverse(T_true)) < 0.02
    assert weights[right].min() > 0.99
    residuals = np.linalg.norm(target - rotate(R, source), axis=1)
    assert residuals[weights > 0.99].max() < 1.6 * NOISE and residuals[weights < 0.01].min() > 1.4 * NOISE


def test_a_vote_is_the_best_of_a_fine_grid_and_a_search_cut_short_says_so_with_a_clique():
    random = np.random.default_rng(0)
    for _ in range(20):
        shifts = np.concatenate([random.normal(0.3, 0.004, 12), random.uniform(-1, 1, 60)])
        t = vote(shifts, NOISE)

        def cost(at, shifts=shifts):
            return np.minimum(np.square(shifts - at), NOISE**2).sum()

        grid = np.linspace(-1.1, 1.1, 20_001)
        assert cost(t) <= min(map(cost, grid)) + 1e-15
    adjacent = graph(120, 0.9, 0)
    clique, certain = largest_clique(adjacent, most_branches=200)
    assert not certain and len(clique) > 10 and is_clique(adjacent, clique)
    again, _ = largest_clique(adjacent, most_branches=200)
    assert np.array_equal(clique, again)


def graph(nodes, density, seed):
    upper = np.triu(np.random.default_rng(seed).uniform(size=(nodes, nodes)) < density, 1)
    return upper | upper.T


def is_clique(adjacent, nodes):
    return all(adjacent[one, other] for one, other in combinations(nodes, 2))


@pytest.mark.parametrize("density", [0.0, 0.2, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("seed", range(6))
def test_none_of_all_subsets_is_a_larger_clique(density, seed):
    adjacent = graph(11, density, seed)
    largest = max(k for k in range(1, 12) if any(is_clique(adjacent, nodes) for nodes in combinations(range(11), k)))
    clique, certain = largest_clique(adjacent)
    assert certain and len(clique) == largest
    assert is_clique(adjacent, clique) and np.array_equal(clique, np.unique(clique))


@pytest.mark.parametrize(("graph", "largest"), [(np.ones((1200,) * 2), 1200), (np.zeros((3, 3)), 1), (np.eye(0), 0)])
def test_a_clique_of_all_nodes_is_not_too_deep_and_a_graph_needs_no_edges_or_nodes(graph, largest):
    assert len(largest_clique(graph.astype(bool))[0]) == largest
