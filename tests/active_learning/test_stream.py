"""Streams, and the models of the learners beside GP-CA."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import log_softmax, softmax

from gpca.active_learning import stream
from gpca.active_learning.acquisition import STREAMS
from gpca.active_learning.rounds import LabelingTask, Samples, initial_gpc
from gpca.active_learning.settings import ActiveLearningSettings, StreamSettings
from gpca.active_learning.stream import BayesianLayer, arrival_order, run_stream
from gpca.classifier.latents import Projection
from gpca.classifier.settings import GPCSettings
from gpca.pairs.perturbation import CONCEPTS

QUICK = GPCSettings(learning_rate=0.05, iterations=30, inducing=12, draws=100)
SETTINGS = ActiveLearningSettings(gpc=QUICK)
STREAM = StreamSettings(arrivals=90, quiet=30, budget=0.2, window=20, every=15)
CENTERS = 4 * np.random.default_rng(0).normal(size=(3, 8))


def blobs(n, seed, concepts=CONCEPTS):
    concept_N = np.array(concepts)[np.arange(n) % len(concepts)]
    centers_N_d = CENTERS[[CONCEPTS.index(concept) for concept in concept_N]]
    return Samples(centers_N_d + np.random.default_rng(seed).normal(size=(n, 8)), concept_N)


@pytest.fixture(scope="module")
def plain():
    """120 samples of known concepts and 60 of the new one to arrive."""
    return LabelingTask("overlap", blobs(40, 1, ("noise", "pose")), blobs(180, 2), blobs(60, 3))


@pytest.fixture(scope="module")
def gpc(plain):
    return initial_gpc(plain, SETTINGS, "blobs", 0)


@pytest.fixture(scope="module")
def task(plain, gpc):
    return plain.project(gpc)


def run(task, gpc, strategy, **changed):
    rows = run_stream(task, gpc, strategy, SETTINGS, dataclasses.replace(STREAM, **changed), "blobs", 0)
    return {name: [row[name] for row in rows] for name in rows[0]}


@pytest.mark.parametrize("arrivals, quiet", [(90, 30), (100, 0), (31, 20), (180, 0), (150, 30)])
def test_the_new_concept_arrives_after_the_quiet_as_a_third(plain, arrivals, quiet):
    order = arrival_order(plain, StreamSettings(arrivals=arrivals, quiet=quiet), "blobs", 0)
    is_new = plain.pool.concept_N[order] == "overlap"
    assert len(order) == len(set(order)) == arrivals
    assert not is_new[:quiet].any()
    assert is_new[quiet:].sum() == round((arrivals - quiet) / 3)
    if arrivals == 150:
        assert [8 <= part.sum() <= 32 for part in np.split(is_new[30:], 2)] == [True, True]
        assert all(set(plain.pool.concept_N[part]) == {"noise", "pose"} for part in (order[:15], order[15:30]))


@pytest.mark.parametrize("budget", [0.05, 0.1, 0.3])
def test_bald_stays_within_the_budget_but_for_the_first_few(task, gpc, budget):
    rows = run(task, gpc, "stream_bald", budget=budget)
    assert (np.array(rows["labels"]) <= budget * np.array(rows["arrived"]) + 3).all()
    assert rows["labels"][-1] >= 0.5 * budget * 90


def test_random_asks_about_the_budgets_share(task, gpc):
    asked = [
        run_stream(task, gpc, "stream_random", SETTINGS, dataclasses.replace(STREAM, every=90), "blobs", seed)[-1]
        for seed in range(6)
    ]
    assert np.mean([row["labels"] for row in asked]) == pytest.approx(0.2 * 90, abs=5)
    assert len({row["labels"] for row in asked}) > 1


@pytest.mark.parametrize("strategy", sorted(STREAMS.keys() - {"stream_random"}))
def test_the_new_concept_is_recognized_once_it_was_asked_about(task, gpc, strategy):
    rows = run(task, gpc, strategy)
    assert rows["new_labels"][:3] == [0, 0, 0]
    assert 0 < rows["new_labels"][-1] < rows["labels"][-1]
    if strategy != "stream_clever":  # a linear layer extrapolates to the class that it has no label of
        assert rows["accuracy"][:3] == pytest.approx([2 / 3] * 3)
        assert rows["accuracy_new"][0] == 0
    assert rows["accuracy_new"][-1] > 0.9
    assert rows["accuracy"][-1] > 0.9


def test_the_running_accuracy_is_that_of_the_last_window(task, gpc):
    rows, of_all = (run(task, gpc, "stream_random", budget=1e-9, every=1, window=w) for w in (20, 90))
    is_new = task.pool.concept_N[arrival_order(task, STREAM, "blobs", 0)] == "overlap"
    assert of_all["running"][90] == pytest.approx(1 - is_new.mean())
    expected = [1, 1 - is_new[30:50].mean(), 1 - is_new[70:90].mean()]
    assert [rows["running"][n] for n in (30, 50, 90)] == pytest.approx(expected)


RANDOM = np.random.default_rng(0)
X_N_D = RANDOM.normal(size=(40, 3))
LABEL_N = X_N_D[:, :3].argmax(axis=1)


def inputs(x_N_D):
    return Projection(x_N_D, np.empty((3, len(x_N_D), 0)), np.empty((3, len(x_N_D))))


def layer(rows):
    rows = np.asarray(rows, int)
    return BayesianLayer(Samples(inputs(X_N_D[rows]), np.array(CONCEPTS)[LABEL_N[rows]]), "blobs", 0)


def test_before_any_label_the_logits_have_the_deviation_of_the_prior():
    mean_N_C, covariance_N_C_C = layer([]).logits(inputs(np.ones((1, 3))))
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


def test_labels_teach_it_and_make_it_surer_but_far_away_no_surer_than_the_prior_allows():
    some, many = layer(np.arange(5)), layer(np.arange(40))
    _, covariance = many.logits(inputs(np.array([[0.0, 0, 0], [50, 50, -100]])))
    assert np.trace(covariance[1]) > 20 * np.trace(covariance[0])
    scores_N_C, variances_N_C, doubt_N = many.attribute(inputs(X_N_D))
    assert np.mean(scores_N_C.argmax(axis=1) == LABEL_N) > 0.85
    assert doubt_N.mean() < some.attribute(inputs(X_N_D))[2].mean()
    assert scores_N_C.sum(axis=1) == pytest.approx(1)
    assert (variances_N_C > 0).all()


def test_what_was_believed_before_is_the_prior_of_what_comes_after():
    one = layer(np.arange(20))
    one.update(inputs(X_N_D[20:]), np.array(CONCEPTS)[LABEL_N[20:]])
    assert one._mean_C_F == pytest.approx(layer(np.arange(40))._mean_C_F)


@pytest.mark.parametrize("deviation", [0.1, 100.0])
def test_no_prior_makes_it_diverge(monkeypatch, deviation):
    monkeypatch.setattr(stream, "DEVIATION", deviation)
    scores_N_C = layer(np.arange(40)).attribute(inputs(X_N_D))[0]
    assert np.isfinite(scores_N_C).all()
