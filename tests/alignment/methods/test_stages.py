"""ICP in stages: with all switched off, one changed at a time, and trimmed."""

from itertools import combinations, product

import numpy as np
import pytest

from gpca.alignment.methods import stages
from gpca.alignment.methods.interface import FailedRegistration, Pair
from gpca.alignment.methods.registry import make_method
from gpca.alignment.methods.stages import VARIANTS, Stages, nearest, run_stages
from gpca.pairs.perturbation import CONCEPTS
from gpca.rigid import exp, inverse, transform

from .pairs import clouds, perturbed, small_motion


@pytest.mark.parametrize("metric", ["point_to_point", "point_to_plane"])
@pytest.mark.parametrize("concept", CONCEPTS)
@pytest.mark.parametrize("index", [0, 2])
def test_with_everything_switched_off_it_is_plain_icp(objects, metric, concept, index):
    pair, _ = perturbed(objects, index, concept)
    T, _, _ = run_stages(pair, Stages(metric=metric, distance=0.1), 50)
    np.testing.assert_allclose(T, make_method(metric)(pair).T_target_source, rtol=0, atol=1e-6)


K = 0.05
WEIGHTS = {  # of a residual r, as the literature has them
    "huber": lambda r: np.where(r <= K, 1.0, K / np.maximum(r, 1e-300)),
    "cauchy": lambda r: 1 / (1 + (r / K) ** 2),
    "geman_mcclure": lambda r: 1 / (1 + (r / K) ** 2) ** 2,
    "tukey": lambda r: np.where(r <= K, (1 - np.minimum(r / K, 1) ** 2) ** 2, 0.0),
}


@pytest.mark.parametrize("kernel", WEIGHTS)
def test_weights_of_a_robust_kernel_give_open3ds_pose(objects, kernel):
    pair, _ = perturbed(objects, 0, "noise")

    def weigh(matches):
        offsets = pair.target[matches.rows] - matches.source
        return WEIGHTS[kernel](np.abs((offsets * pair.target_normals[matches.rows]).sum(axis=1)))

    T, _, _ = run_stages(pair, Stages(metric="point_to_plane", weigh=weigh, distance=0.1), 50)
    np.testing.assert_allclose(T, make_method(kernel)(pair).T_target_source, rtol=0, atol=1e-6)


def test_normals_of_the_source_turn_with_it_and_few_matches_and_no_weight_are_failures(objects):
    pair, T_true = small_motion(objects)
    matches = Stages().match(pair, T_true)
    assert np.median(matches.cosines()) == pytest.approx(1, abs=1e-6)  # most neighbors lie on the same face
    assert np.median(Stages().match(pair, np.eye(4)).cosines()) < 0.999
    with pytest.raises(FailedRegistration, match="fewer than 3 correspondences"):
        run_stages(pair, Stages(reject=lambda matches: matches.kept(np.arange(2))), 50)
    with pytest.raises(FailedRegistration, match="no correspondence has any weight"):
        run_stages(pair, Stages(weigh=lambda matches: np.zeros(len(matches.distance))), 50)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_a_search_that_knows_the_matches_before_finds_the_same(objects, share):
    pair, T_true = perturbed(objects, 0, "overlap")
    shared = Stages(share=share)
    for T in (np.eye(4), T_true):
        before = shared.match(pair, T)
        for T_next in (T, shared.step(before) @ T, np.linalg.inv(T_true)):
            bounded, free = shared.match(pair, T_next, before), shared.match(pair, T_next)
            for name in ("source_rows", "rows", "distance"):
                np.testing.assert_array_equal(getattr(bounded, name), getattr(free, name))


def test_a_share_counts_all_points_of_the_source(objects):
    pair, T_true = small_motion(objects)
    rows = np.arange(0, len(pair.source), 2)
    matches = Stages(rows=rows, share=0.5).match(pair, T_true)
    least = np.sort(pair.target_tree.query(matches.pair.source @ T_true[:3, :3].T + T_true[:3, 3])[0][rows])
    np.testing.assert_allclose(np.sort(matches.distance), least[: round(len(rows) / 2)])
    distance = float(np.median(matches.distance))
    assert 0 < len(Stages(share=0.5, distance=distance).match(pair, T_true).distance) <= len(pair.source) / 2


OFF = {"SAMPLED": 1.0, "DEVIATIONS": 1e6, "LEAST_COSINE": -2.0, "WORST": 0.0}


@pytest.mark.parametrize("name", [name for name, (_, stage, _) in VARIANTS.items() if stage != "weigh"])
def test_a_variant_that_is_switched_off_is_plain_icp(objects, monkeypatch, name):
    pair, _ = perturbed(objects, 0, "noise")
    for constant, value in OFF.items():
        monkeypatch.setattr(stages, constant, value)
    off, plain = (make_method(each)(pair) for each in (name, "point_to_plane"))
    np.testing.assert_allclose(off.T_target_source, plain.T_target_source, rtol=0, atol=1e-6)
    assert off.fitness == pytest.approx(plain.fitness)


def test_samples_in_normal_space_are_even_over_directions(monkeypatch):
    """A floor of 900 points and two walls of 50: half of the random points would be floor, here a third is."""
    normals = np.repeat(np.eye(3), [900, 50, 50], axis=0)
    pair = Pair(np.random.default_rng(0).normal(size=(1000, 3)), np.eye(3), source_normals=normals)
    monkeypatch.setattr(stages, "SAMPLED", 0.12)
    rows = stages.sample_normal_space(pair)
    assert np.array_equal(rows, np.unique(rows)) and len(rows) == 120
    assert np.array_equal(normals[rows].sum(axis=0), [40, 40, 40])
    assert normals[stages.sample_at_random(pair)].sum(axis=0)[0] > 90
    monkeypatch.setattr(stages, "SAMPLED", 0.3)
    assert normals[stages.sample_normal_space(pair)].sum(axis=0).tolist() == [200, 50, 50]  # all there are


def test_rejections_keep_what_they_say_and_weights_fall_with_distance_and_angle(objects):
    pair, _ = perturbed(objects, 0, "noise")
    matches = Stages(distance=0.1).match(pair, np.eye(4))
    d, cosines = matches.distance, matches.cosines()
    by_distance, by_normals, worst = (VARIANTS[f"reject_{by}"][2](matches) for by in ("distance", "normals", "worst"))
    assert np.array_equal(by_distance.distance, d[d <= d.mean() + 2.5 * d.std()])
    assert np.array_equal(by_normals.rows, matches.rows[cosines >= np.cos(np.pi / 4)])
    assert np.array_equal(np.sort(worst.distance), np.sort(d)[: round(0.9 * len(d))])
    assert [nearest(d, count).tolist() for count in (1, 0)] == [[d.argmin()]] * 2  # never none
    for part in (by_normals, worst):
        assert 0 < len(part.distance) < len(d)
        np.testing.assert_allclose(np.linalg.norm(pair.target[part.rows] - part.source, axis=1), part.distance)

    np.testing.assert_allclose(VARIANTS["weight_distance"][2](matches), 1 - matches.distance / 0.1)
    weights = VARIANTS["weight_normals"][2](matches)
    assert np.array_equal(weights[cosines > 0], np.minimum(cosines[cosines > 0], 1)) and not weights[cosines < 0].any()


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
