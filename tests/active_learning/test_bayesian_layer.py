import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import log_softmax, softmax

from gpca.active_learning.stream_models import BayesianLayer

RANDOM = np.random.default_rng(0)
X_N_D = RANDOM.normal(size=(40, 3))
LABEL_N = X_N_D[:, :3].argmax(axis=1)
NORMAL_M_C = RANDOM.normal(size=(200, 3))


def layer(rows, deviation=3.0):
    made = BayesianLayer(3, 3, deviation)
    made.learn(X_N_D[rows], LABEL_N[rows])
    return made


def test_before_any_label_the_logits_have_the_deviation_of_the_prior():
    mean_N_C, covariance_N_C_C = layer([]).logits(np.ones((1, 3)))
    assert not mean_N_C.any()
    assert covariance_N_C_C[0] == pytest.approx(9 * np.eye(3))


def test_after_one_label_it_is_laplaces_approximation():
    features = np.append(X_N_D[0], 1)

    def loss(flat):
        return -log_softmax(flat.reshape(3, 4) @ features)[LABEL_N[0]] + flat @ flat / (2 * 9 / 4)

    best = minimize(loss, np.zeros(12), tol=1e-12).x.reshape(3, 4)
    p_C = softmax(best @ features)
    curvature = np.kron(np.diag(p_C) - np.outer(p_C, p_C), np.outer(features, features))
    made = layer([0])
    assert made._mean_C_F == pytest.approx(best, abs=1e-5)
    assert made._covariance_P_P == pytest.approx(np.linalg.inv(curvature + np.eye(12) / (9 / 4)), abs=1e-5)


def test_labels_teach_it_and_make_it_surer():
    some, many = layer(np.arange(5)), layer(np.arange(40))
    scores_N_C, variances_N_C, bald_N = many.attribute(X_N_D, NORMAL_M_C)
    assert np.mean(scores_N_C.argmax(axis=1) == LABEL_N) > 0.85
    assert bald_N.mean() < some.attribute(X_N_D, NORMAL_M_C)[2].mean()
    assert scores_N_C.sum(axis=1) == pytest.approx(1)
    assert (variances_N_C > 0).all()


def test_what_was_believed_before_is_the_prior_of_what_comes_after():
    one = layer(np.arange(20))
    one.learn(X_N_D[20:], LABEL_N[20:])
    assert one._mean_C_F == pytest.approx(layer(np.arange(40))._mean_C_F)


def test_far_away_it_is_as_unsure_as_the_prior_allows():
    _, covariance = layer(np.arange(40)).logits(np.array([[0.0, 0, 0], [50, 50, -100]]))
    assert np.trace(covariance[1]) > 20 * np.trace(covariance[0])


@pytest.mark.parametrize("deviation", [0.1, 100.0])
def test_no_prior_makes_it_diverge(deviation):
    scores_N_C = layer(np.arange(40), deviation).attribute(X_N_D, NORMAL_M_C)[0]
    assert np.isfinite(scores_N_C).all()
