from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gpca.pairs.perturbation import within_half_space
from gpca.reenactment.hypotheses import distinct_rows, find_hypotheses, log_prior, rotations, search_starts
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import exp, inverse, rotation_angle_rad, transform
from tests.reenactment.conftest import candidate_of, pair_of


@pytest.mark.parametrize(("count", "largest_deg", "gap_deg"), [(48, 109.0, 45), (24, 180.0, 75)])
def test_rotations_of_every_size_have_one_near_by(count, largest_deg, gap_deg):
    spread = rotations(count, largest_deg)
    assert len(spread) == pytest.approx(count, rel=0.25)
    assert np.rad2deg(Rotation.from_matrix(spread).magnitude()).max() <= largest_deg + 1e-6
    drawn = Rotation.random(300, np.random.default_rng(0))
    drawn = drawn[drawn.magnitude() < np.deg2rad(largest_deg)]
    nearest = [(Rotation.from_matrix(spread) * turn.inv()).magnitude().min() for turn in drawn]
    assert np.rad2deg(np.quantile(nearest, 0.95)) < gap_deg


def test_starts_begin_with_the_initial_pose_and_lay_centers_on_each_other():
    random = np.random.default_rng(0)
    observed, model = random.normal(size=(50, 3)) + 3, random.normal(size=(60, 3))
    starts = search_starts(observed, model)
    assert np.array_equal(starts[0], np.eye(4))
    centers = starts[:, :3, :3] @ observed.mean(axis=0) + starts[:, :3, 3]
    on_center = np.isclose(centers, model.mean(axis=0)).all(axis=1)
    about_origin = (starts[:, :3, 3] == 0).all(axis=1)
    assert (on_center | about_origin).all() and on_center.sum() > about_origin.sum() > 10


SETTINGS = ReenactmentSettings()


def found(pair, surface, settings=SETTINGS):
    before = transform(pair.T_init, pair.observed)
    return find_hypotheses(before, surface, pair.T_runs @ inverse(pair.T_init), settings, np.random.default_rng(0))


@pytest.mark.parametrize("causes", [(), ("noise",), ("pose",), ("overlap",), ("pose", "overlap")])
def test_the_true_pose_is_mostly_the_most_probable(drill, causes):
    errors = []
    for seed in (102, 103, 104):
        pair, T_true = pair_of(candidate_of(drill, *causes, seed=seed))
        surface = ModelSurface(pair.model)
        hypotheses = found(pair, surface)
        errors.append(surface.errors((hypotheses[0].T @ inverse(T_true))[None])[0])
        posterior = [hypothesis.log_posterior for hypothesis in hypotheses]
        assert posterior == sorted(posterior, reverse=True) and posterior[0] - posterior[-1] < 4.5
    assert np.median(errors) < 0.02  # with so little left of a cloud, a single one may be off


def test_where_the_model_lacks_surface_the_points_beyond_are_neither_outliers_nor_a_reason_for_another_pose(drill):
    candidate = candidate_of(drill, "pose", seed=101)
    axis = int(np.ptp(drill, axis=0).argmax())
    candidate = replace(candidate, model=candidate.model[within_half_space(candidate.model[:, axis], 0.3, 1)])
    pair, T_true = pair_of(candidate)
    surface = ModelSurface(candidate.model)
    best = found(pair, surface)[0]
    assert surface.errors((best.T @ inverse(T_true))[None])[0] < 0.03
    before = transform(T_true, transform(pair.T_init, pair.observed))
    beyond = before[:, axis] > candidate.model[:, axis].max() + 0.1
    assert beyond.sum() > 20 and (best.lone_N[beyond] > 0.5).mean() > 0.9 and (best.inlier_N[beyond] > 0.5).all()
    assert (best.lone_N[~beyond] > 0.5).mean() < 0.5


def test_a_can_has_one_hypothesis_however_it_is_turned_about_its_axis(can):
    candidate = candidate_of(can, "pose")
    pair, _ = pair_of(candidate)
    surface = ModelSurface(candidate.model)
    hypotheses = found(pair, surface)
    between = [h.T @ inverse(hypotheses[0].T) for h in hypotheses[1:]]
    # It also fits upside down: those are no farther apart than its points tell.
    assert all(surface.apart(T[None])[0] > 0.006 for T in between)
    assert surface.errors((hypotheses[0].T @ inverse(pair_of(candidate)[1]))[None])[0] < 0.02


def test_poses_that_leave_the_surface_where_it_is_are_one(can):
    surface = ModelSurface(can[:400])
    turns = exp(np.array([[0, 0, 0, 0, 0, 0], [0, 0, 0.7, 0, 0, 0], [0, 0, 0, 0.1, 0, 0], [1e-4, 0, 0, 0.1, 0, 0]]))
    assert distinct_rows(surface, turns, most=4, limit=0.02) == [0, 2]
    assert distinct_rows(surface, turns, most=1, limit=0.02) == [0]


def test_good_starts_are_probable_and_errors_beyond_all_bounds_are_not():
    poses = [exp(np.array([[angle, 0, 0, length, 0, 0]]))[0] for angle, length in ((0, 0), (0.03, 0.01), (0.7, 0.2))]
    near, small, large = (log_prior(T, SETTINGS) for T in poses)
    assert near >= small > large
    assert log_prior(exp(np.array([[0, 0, 0, 2.0, 0, 0]]))[0], SETTINGS) < large - 10
    assert rotation_angle_rad(poses[2]) == pytest.approx(0.7)


def test_evidence_from_elsewhere_counts(drill):
    candidate = candidate_of(drill, "pose", seed=101)
    pair, T_true = pair_of(candidate)
    surface = ModelSurface(candidate.model)

    def against_the_truth(T, width):
        return -100.0 if surface.apart((T @ inverse(T_true))[None])[0] < 0.05 else 0.0

    before, T_found_n = transform(pair.T_init, pair.observed), pair.T_runs @ inverse(pair.T_init)
    arguments = before, surface, T_found_n, SETTINGS
    near, far = (
        find_hypotheses(*arguments, np.random.default_rng(0), evidence)[0].T for evidence in (None, against_the_truth)
    )
    assert surface.apart((near @ inverse(T_true))[None])[0] < 0.02
    assert surface.apart((far @ inverse(T_true))[None])[0] > 0.05
