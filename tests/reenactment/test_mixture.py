import numpy as np
import pytest
from scipy.stats import multivariate_normal

from gpca.reenactment.mixture import Anchor, Mixture
from gpca.reenactment.mixture_kernels import FIRST_OUTLIERS, REACH
from gpca.rigid import exp, inverse, transform

RANDOM = np.random.default_rng(100)


def plain_log_likelihood(points, model, width, outliers):
    normal = np.mean([multivariate_normal(m, width**2 * np.eye(3)).pdf(points) for m in model], axis=0)
    return np.log((1 - outliers) * normal + outliers).mean()


def test_the_likelihood_is_that_of_all_partners_within_reach_and_of_uniform_outliers(drill, model):
    points = drill[400:500] + RANDOM.normal(scale=0.02, size=(100, 3))
    fits = Mixture(model.points, 0.01).fit(points, np.eye(4)[None], iterations=5, moving=False)
    expected = plain_log_likelihood(points, model.points, fits.width_n[0], fits.outliers_n[0])
    assert fits.log_likelihood_n[0] == pytest.approx(expected, abs=5e-3)  # partners that are far off count as none
    assert np.array_equal(fits.T_n[0], np.eye(4))
    points, variance = drill[400:500] + RANDOM.normal(scale=0.05, size=(100, 3)), 0.05**2
    squares = ((points[:, None] - model.points) ** 2).sum(axis=2)
    weights = np.where(squares < REACH * variance, np.exp(-0.5 * squares / variance), 0)
    density = (1 - FIRST_OUTLIERS) * weights.mean(axis=1) * (2 * np.pi * variance) ** -1.5 + FIRST_OUTLIERS
    fits = Mixture(model.points, 0.05).fit(points, np.eye(4)[None], iterations=0)
    assert fits.log_likelihood_n[0] == pytest.approx(np.log(density).mean(), abs=1e-8)
    assert fits.inlier_n_N[0] == pytest.approx(1 - FIRST_OUTLIERS / density, abs=1e-8)


def test_a_known_pose_is_recovered_from_noise_and_outliers_which_alone_move_nothing(drill, model):
    T_true = exp(np.array([[0.15, -0.1, 0.2, 0.03, 0.02, -0.04]]))[0]
    points = drill[400:800] + RANDOM.normal(scale=0.02, size=(400, 3))
    points[:20] = RANDOM.uniform(-0.5, 0.5, size=(20, 3))
    fits = Mixture(model.points, model.spacing / 2).fit(transform(inverse(T_true), points), np.eye(4)[None], 60)
    assert model.errors(fits.T_n @ inverse(T_true))[0] < 0.015
    assert fits.inlier_n_N[0, 20:].mean() > 0.9 > 0.6 > fits.inlier_n_N[0, :20].mean()
    assert 0.02 < fits.width_n[0] < 0.045  # of the noise, and of the gaps between the model's points
    fits = Mixture(model.points, 0.01).fit(np.full((5, 3), 9.0), np.eye(4)[None], 4)
    assert np.array_equal(fits.T_n[0], np.eye(4))
    assert (fits.inlier_n_N == 0).all() and fits.outliers_n[0] == 0.2


def test_an_anchor_holds_the_pose_as_firmly_as_it_is_strong_and_weighs_turns_by_its_deviations(drill, model):
    T_off = exp(np.array([[0.1, 0, 0, 0, 0.05, 0]]))[0]
    points, mixture = transform(T_off, drill[400:800]), Mixture(model.points, 0.02)

    def error(strength):
        anchor = Anchor(0.03, 0.01, strength)
        return model.errors(mixture.fit(points, np.eye(4)[None], 30, anchor=anchor).T_n @ T_off)[0]

    errors = [error(strength) for strength in (1e-6, 10, 100, 1e6)]
    assert errors[0] < 0.015 < errors[1] < errors[2] and errors[-1] == pytest.approx(
        model.errors(T_off[None])[0], rel=1e-3
    )
    anchor = Anchor(0.03, 0.01)
    points = anchor.arm * np.concatenate([np.eye(3), -np.eye(3)])
    turn, shift = (exp(np.array([twist]))[0] for twist in ([0.003, 0, 0, 0, 0, 0], [0, 0, 0, 0.001, 0, 0]))
    by_turn, by_shift = (((transform(T, points) - points) ** 2).sum() for T in (turn, shift))
    assert by_turn == pytest.approx(by_shift, rel=1e-3)  # each is a tenth of a deviation
