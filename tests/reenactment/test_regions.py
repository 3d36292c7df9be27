"""Which part of a surface was observed, if it is no side of a plane."""

import numpy as np
import pytest

from gpca.causes.candidate import visible_rows
from gpca.reenactment.surface import before_plane, covered_points


def wrong(drill, model, hidden, noise, seed=0):
    """Share of the model's points that are wrongly taken for observed or not; `hidden` returns a mask of points."""
    random = np.random.default_rng(seed)
    observed = drill[400:2000][~hidden(drill[400:2000])][:500]
    found = covered_points(model, observed + noise * random.normal(size=observed.shape), noise, random)
    return (found == hidden(model.points)).mean()


@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_patches_that_nothing_was_observed_in_are_missing(drill, model, noise):
    def hidden(points):
        return (np.linalg.norm(points[:, None] - drill[[5, 77]], axis=2) < 0.22).any(axis=1)

    assert 0.2 < hidden(model.points).mean() < 0.7
    assert wrong(drill, model, hidden, noise) < 0.15


@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_what_one_side_hides_is_missing(drill, model, noise):
    toward = np.array([0.3, 0.9, -0.3])
    visible = drill[visible_rows(drill, toward)]

    def hidden(points):
        return np.linalg.norm(points[:, None] - visible, axis=2).min(axis=1) > 0.03

    plane = np.abs(np.linspace(0, 1, 50) - hidden(model.points).mean()).min()
    assert plane < 0.05 and wrong(drill, model, hidden, noise) < 0.25


@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_what_is_cut_off_by_a_plane_remains_so(drill, model, noise):
    random = np.random.default_rng(0)
    for limit in (0.02, np.inf):
        observed = drill[400:1200][drill[400:1200, 0] < limit]
        observed = observed + noise * random.normal(size=observed.shape)
        by_plane = before_plane(model.points, observed, noise, np.random.default_rng(1))
        found = covered_points(model, observed, noise, np.random.default_rng(1))
        assert (found == by_plane).mean() > 0.85
