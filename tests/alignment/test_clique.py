from itertools import combinations

import numpy as np
import pytest

from gpca.alignment.clique import largest_clique


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


def test_a_hidden_clique_is_found():
    adjacent = graph(400, 0.15, 0)
    hidden = np.sort(np.random.default_rng(1).choice(400, 30, replace=False))
    adjacent[np.ix_(hidden, hidden)] = True  # the diagonal with it, which does not matter
    clique, certain = largest_clique(adjacent)
    assert certain and set(hidden) <= set(clique)


def test_a_search_that_is_cut_short_says_so_and_gives_a_clique():
    adjacent = graph(120, 0.9, 0)
    clique, certain = largest_clique(adjacent, most_branches=200)
    assert not certain and len(clique) > 10 and is_clique(adjacent, clique)
    again, _ = largest_clique(adjacent, most_branches=200)
    assert np.array_equal(clique, again)


def test_a_clique_of_all_nodes_is_not_too_deep():
    assert len(largest_clique(np.ones((1200, 1200), bool))[0]) == 1200


def test_graphs_without_edges_or_nodes():
    assert len(largest_clique(np.zeros((3, 3), bool))[0]) == 1
    assert len(largest_clique(np.zeros((0, 0), bool))[0]) == 0
