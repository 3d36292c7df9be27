from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from baselines.trivial import EXPLAINERS, HYPOTHESIS
from gpca.pairs.dataset import ragged
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.trivial import TRIVIAL, trivial_numbers, trivial_numbers_of
from gpca.rigid import rigid_motion, transform


def numbers(observed, model, T_init, fitness=0.7, inlier_rmse=0.02):
    return dict(zip(TRIVIAL, trivial_numbers(observed, model, T_init, fitness, inlier_rmse), strict=True))


def test_the_ten_numbers_are_what_they_are_called_and_do_not_depend_on_where_the_clouds_differ():
    grid = np.stack(np.meshgrid(*[np.arange(4) * 0.1] * 3), axis=-1).reshape(-1, 3)
    back = rigid_motion(Rotation.from_euler("z", 0.4).as_matrix(), np.array([0.0, 0.03, 0.04]))
    found = numbers(grid - grid.mean(axis=0), 2 * grid[:32], back)
    assert found["turn"] == pytest.approx(0.4) and found["shift"] == pytest.approx(0.05)
    for cloud, spacing, points in (("observed", 0.1, 64), ("model", 0.2, 32)):
        assert np.exp(found[f"log_{cloud}_spacing"]) == pytest.approx(spacing)
        assert np.exp(found[f"log_{cloud}_points"]) == pytest.approx(points)
    assert np.exp(found["log_observed_extent"]) == pytest.approx(np.sqrt(3 * 0.0125))
    assert (found["fitness"], np.exp(found["log_inlier_rmse"])) == (0.7, pytest.approx(0.02))
    moved = transform(rigid_motion(np.eye(3), np.array([1.0, 2.0, 3.0])), grid)
    here, there = (numbers(cloud, grid, np.eye(4)) for cloud in (grid, moved))
    assert here == pytest.approx(there)


def explained(name, train, asked):
    explainer = EXPLAINERS[name].make("tiny", 100)
    explainer.fit(train)
    return explainer.explain(asked.without_labels())


def perturbed(registrations, random, count=90):
    """Samples whose turn gives pose away, and whose number of points gives overlap away, beyond unusual limits."""
    rows = registrations.subset(np.zeros(count, int))
    concept = np.array(CONCEPTS)[np.arange(count) % 3]
    angle_deg = np.where(concept == "pose", random.uniform(22, 40, count), random.uniform(0, 18, count))
    share = np.where(concept == "overlap", random.uniform(0.3, 0.6, count), random.uniform(0.7, 1.0, count))
    target = rows.target(0)
    clouds = [target[random.permutation(len(target))[: round(part * len(target))]] for part in share]
    turn_N = np.array([rigid_motion(Rotation.from_euler("x", angle, True).as_matrix()) for angle in angle_deg])
    turned = replace(rows, concept=concept, sample=np.arange(count), **ragged(clouds, [target] * count))
    return replace(turned, T_target_source_icp=turn_N @ turned.T_target_source_init)


def test_constants_that_are_fitted_find_limits_that_the_rule_does_not_have(registrations):
    random = np.random.default_rng(0)
    train, test = perturbed(registrations, random), perturbed(registrations, random)
    for name in ("rule_fitted", "tree_trivial", "logistic_trivial"):
        assert (explained(name, train, test).predicted_N == test.concept).mean() > 0.9, name
    assert trivial_numbers_of(train).shape == (90, 10)


def test_hypotheses_read_the_best_hypothesis_and_nothing_that_was_enacted(registrations):
    from gpca.reenactment.dataset import FEATURES

    random, count = np.random.default_rng(0), 60
    concept = np.array(CONCEPTS)[np.arange(count) % 3]
    numbers_N_F = random.random((count, len(FEATURES)))
    columns = [FEATURES.index(f"first_{name}") for name in HYPOTHESIS]
    for cause, name in (("noise", "noise"), ("overlap", "missing")):
        numbers_N_F[concept == cause, FEATURES.index(f"first_{name}")] += 2
    asked = replace(registrations.subset(np.zeros(count, int)), concept=concept, attached={"reenactment": numbers_N_F})
    found = explained("hypotheses", asked, asked)
    assert (found.predicted_N == concept).mean() > 0.95
    others = np.full_like(numbers_N_F, 7.0)
    others[:, columns] = numbers_N_F[:, columns]
    again = explained("hypotheses", asked, replace(asked, attached={"reenactment": others}))
    assert np.array_equal(found.scores_N_C, again.scores_N_C)
