import numpy as np
import pytest

from gpca.reenactment.surface import covered_points, directions


def seen(points, share, along):
    order = np.argsort(points @ along)
    return points[order[: round(len(points) * (1 - share))]]


def covered(model, observed, noise, seed=0):
    return covered_points(model.points, observed, noise, np.random.default_rng(seed))


@pytest.mark.parametrize("share", [0.2, 0.4, 0.6])
@pytest.mark.parametrize("noise", [0.0, 0.03, 0.06])
def test_the_missing_share_is_found_whatever_the_noise(drill, model, share, noise):
    random = np.random.default_rng(3)
    found = []
    for along in random.normal(size=(6, 3)):
        observed = seen(drill[400:1200], share, along / np.linalg.norm(along))
        found.append(
            1 - covered(model, observed + random.normal(scale=max(noise, 1e-9), size=observed.shape), noise).mean()
        )
    assert np.mean(found) == pytest.approx(share, abs=0.07)
    assert np.abs(np.array(found) - share).max() < 0.2


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_nothing_is_missing_of_a_whole_surface(drill, model, noise):
    observed = drill[400:900] + np.random.default_rng(4).normal(scale=max(noise, 1e-9), size=(500, 3))
    assert covered(model, observed, noise).all()


def test_the_side_that_is_missing_is_the_one_that_was_cut_off(drill, model):
    along = np.array([1.0, 0, 0])
    is_covered = covered(model, seen(drill[400:1200], 0.5, along), 0.0)
    limit = np.median(model.points @ along)
    assert (is_covered == (model.points @ along <= limit)).mean() > 0.9


def test_directions_are_unit_vectors_all_around():
    assert np.linalg.norm(directions(), axis=1) == pytest.approx(1)
    assert np.abs(directions().mean(axis=0)).max() < 0.01
    assert np.sort(directions() @ directions().T, axis=1)[:, -2].min() > np.cos(np.deg2rad(20))
