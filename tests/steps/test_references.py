"""References: what varies in each, and what does not."""

from itertools import islice

import numpy as np
import pytest

from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.registry import make_method
from gpca.causes.candidate import draw_candidate
from gpca.causes.settings import CauseSettings
from gpca.rigid import exp, transform
from gpca.steps.estimates import Redraws, draw_twists
from gpca.uncertainty.estimators.interface import RegisteredPair

SETTINGS = CauseSettings(points=(256, 512))
POINTS = 10_000  # more than there are
TURNED = exp(np.array([[0.1, 0, 0, 0, 0.05, 0]]))[0]


@pytest.fixture(scope="module")
def surface():
    """A brick with a step, dense enough that other points of it are near: it holds a pose."""
    random = np.random.default_rng(0)
    points = random.uniform(-0.5, 0.5, size=(6000, 3)) * (0.5, 0.7, 0.4)
    side = random.integers(3, size=len(points))
    points[np.arange(len(points)), side] = (
        np.sign(points[np.arange(len(points)), side]) * np.array([0.25, 0.35, 0.2])[side]
    )
    return points


def redraws_of(surface, *applied, seed=0):
    candidate = draw_candidate(surface, np.array(applied), SETTINGS, np.random.default_rng(seed))
    return Redraws(candidate, surface, TURNED, POINTS)


def registered_of(redraws, method="point_to_point"):
    causes = tuple(np.flatnonzero(redraws.candidate.applied).tolist())
    observed = transform(TURNED, redraws.candidate.observed(causes))
    pair = Pair(redraws.candidate.model, observed, TURNED, seed=7).with_normals()
    return RegisteredPair(pair, make_method(method)(pair), method, np.full(6, 0.05))


def test_other_data_has_the_same_causes_severities_and_numbers_of_points(surface):
    redraws = redraws_of(surface, True, True, True)
    candidate = redraws.candidate
    whole = {tuple(point) for point in surface.tolist()}
    before = transform(TURNED, candidate.observed((0, 2)))
    for source, target in islice(redraws.clouds("a"), 5):
        assert source.shape == candidate.model.shape
        assert {tuple(point) for point in source.tolist()} <= whole
        assert target.shape == before.shape
        assert not np.array_equal(np.sort(target, axis=0), np.sort(before, axis=0))
        back = transform(np.linalg.inv(TURNED), target)
        along = back @ candidate.toward_hidden  # nearly all that is left lies on this side, up to noise and outliers
        limit = (candidate.clean[candidate.kept] @ candidate.toward_hidden).max()
        assert np.mean(along > limit + 4 * candidate.severity["noise"]) < 0.1


def test_noise_and_outliers_are_as_strong_as_before(surface):
    from scipy.spatial import cKDTree

    redraws = redraws_of(surface, True, False, False)
    tree = cKDTree(surface)
    before, *after = (
        np.median(tree.query(cloud)[0])
        for cloud in (
            redraws.candidate.observed((0,)),
            *(transform(np.linalg.inv(TURNED), target) for _, target in islice(redraws.clouds("a"), 4)),
        )
    )
    assert np.array(after) == pytest.approx(before, rel=0.4)


@pytest.mark.parametrize("method", ["point_to_point", "point_to_plane", "trimmed"])
def test_what_is_determined_hardly_varies_with_the_data(surface, method):
    redraws = redraws_of(surface, False, False, False)
    registered = registered_of(redraws, method)
    twists = draw_twists("data", registered, redraws, 10, "a")
    assert len(twists) == 10
    assert np.abs(twists).max() < 0.1
