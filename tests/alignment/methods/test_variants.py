import numpy as np
import pytest

from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.registry import make_method, methods
from gpca.alignment.methods.stages import Stages, nearest
from gpca.alignment.methods.variants import METHODS, _reject, _sample, _weigh

from .pairs import perturbed, small_motion

OFF = {
    "random_sampling": {"sampled": 1.0},
    "normal_space": {"sampled": 1.0},
    "reject_distance": {"deviations": 1e6},
    "reject_normals": {"angle_deg": 180.0},
    "reject_worst": {"worst": 0.0},
    "weight_distance": {"weighting": "none"},
    "weight_normals": {"weighting": "none"},
}


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("metric", ["point_to_point", "point_to_plane"])
def test_a_variant_that_is_switched_off_is_plain_icp(objects, name, metric):
    pair, _ = perturbed(objects, 0, "noise")
    plain = make_method(metric)(pair)
    off = make_method(name, OFF[name] | {"metric": metric})(pair)
    np.testing.assert_allclose(off.T_target_source, plain.T_target_source, rtol=0, atol=1e-6)
    assert off.fitness == pytest.approx(plain.fitness)
    on = make_method(name, {"metric": metric})(pair)
    assert np.abs(on.T_target_source - plain.T_target_source).max() > 1e-4


def test_every_variant_ends_at_a_pose_of_its_own(objects):
    pair, _ = perturbed(objects, 0, "noise")
    poses = [make_method(name)(pair).T_target_source for name in METHODS]
    assert len(np.unique(np.round(poses, 5), axis=0)) == len(METHODS) == len(OFF)
    assert METHODS.keys() <= methods().keys()


def test_samples_in_normal_space_are_even_over_directions():
    """A floor of 900 points and two walls of 50: half of the random points would be floor, here a third is."""
    normals = np.repeat(np.eye(3), [900, 50, 50], axis=0)
    pair = Pair(np.random.default_rng(0).normal(size=(1000, 3)), np.eye(3), source_normals=normals)
    rows = _sample(pair, "normal_space", 0.12)
    assert np.array_equal(rows, np.unique(rows)) and len(rows) == 120
    assert np.array_equal(normals[rows].sum(axis=0), [40, 40, 40])
    assert normals[_sample(pair, "normal_space", 0.3)].sum(axis=0).tolist() == [200, 50, 50]  # all there are
    assert normals[_sample(pair, "random", 0.12)].sum(axis=0)[0] > 90


def test_samples_are_drawn_by_the_seed_of_the_pair(objects):
    pair, _ = small_motion(objects)
    other = Pair(pair.source, pair.target, source_normals=pair.source_normals, seed=1)
    for sampling in ("random", "normal_space"):
        assert np.array_equal(_sample(pair, sampling, 0.3), _sample(pair, sampling, 0.3))
        assert not np.array_equal(_sample(pair, sampling, 0.3), _sample(other, sampling, 0.3))
    assert _sample(pair, "all", 0.3) is None


def test_rejections_keep_what_they_say(objects):
    pair, _ = perturbed(objects, 0, "noise")
    matches = Stages(distance=0.1).match(pair, np.eye(4))
    limits = {"deviations": 1.5, "angle_deg": 30.0, "worst": 0.2}
    d = matches.distance
    kept = {criterion: _reject(matches, criterion, **limits) for criterion in ("distance", "normals", "trimming")}
    assert np.array_equal(kept["distance"].distance, d[d <= d.mean() + 1.5 * d.std()])
    assert np.array_equal(kept["normals"].rows, matches.rows[matches.cosines() >= np.cos(np.pi / 6)])
    assert np.array_equal(np.sort(kept["trimming"].distance), np.sort(d)[: round(0.8 * len(d))])
    for part in kept.values():
        assert 0 < len(part.distance) < len(d)
        np.testing.assert_allclose(np.linalg.norm(pair.target[part.rows] - part.source, axis=1), part.distance)


def test_weights_fall_with_distance_and_angle(objects):
    pair, _ = perturbed(objects, 0, "noise")
    matches = Stages(distance=0.1).match(pair, np.eye(4))
    np.testing.assert_allclose(_weigh(matches, "distance"), 1 - matches.distance / 0.1)
    weights, cosines = _weigh(matches, "normals"), matches.cosines()
    assert np.array_equal(weights[cosines > 0], np.minimum(cosines[cosines > 0], 1)) and not weights[cosines < 0].any()


def test_the_nearest_are_never_none():
    assert nearest(np.array([3.0, 1.0, 2.0]), 2).tolist() == [1, 2]
    assert nearest(np.array([3.0, 1.0, 2.0]), 0).tolist() == [1]
