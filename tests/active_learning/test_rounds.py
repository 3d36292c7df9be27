"""Rounds of labeling of a new concept."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

import gpca.active_learning.rounds
from gpca.active_learning.rounds import Samples, initial_gpc, make_task, rounds, step_of
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.classifier.settings import GPCSettings
from gpca.pairs.perturbation import CONCEPTS

QUICK = GPCSettings(learning_rate=0.05, iterations=30, inducing=12, draws=100)
SETTINGS = ActiveLearningSettings(initial=12, labels=10, batch=4, gpc=QUICK)


@pytest.fixture(scope="module")
def embedded(registrations):
    """The registrations, with an embedding that tells their concepts apart."""
    random = np.random.default_rng(0)
    centers = 4 * random.normal(size=(3, 8))
    concept_S = [CONCEPTS.index(concept) for concept in registrations.concept]
    embedding = centers[concept_S] + random.normal(size=(len(registrations), 8))
    return dataclasses.replace(registrations, attached={"embedding": embedding})


@pytest.fixture(scope="module")
def gpc(embedded):
    return initial_gpc(make_task(embedded, "overlap", SETTINGS, "tiny", 0), SETTINGS, "tiny", 0)


@pytest.fixture(scope="module")
def task(embedded, gpc):
    return make_task(embedded, "overlap", SETTINGS, "tiny", 0).project(gpc)


def learned(task, gpc, strategy="bald_kmeans", **changed):
    steps = [step for step, _ in rounds(task, gpc, strategy, dataclasses.replace(SETTINGS, **changed), "tiny", 0)]
    return {name: [step[name] for step in steps] for name in steps[0]}


def count(samples):
    return {concept: int(np.sum(samples.concept_N == concept)) for concept in CONCEPTS}


def rows_of(embedded, samples):
    """The registrations that samples are, found by their embeddings."""
    row_of = {h.tobytes(): row for row, h in enumerate(embedded.embedding)}
    return [row_of[h.tobytes()] for h in samples.h]


@pytest.mark.parametrize("held_out", CONCEPTS)
def test_a_task_deals_out_every_sample_once(embedded, held_out):
    task = make_task(embedded, held_out, SETTINGS, "tiny", 0)
    initial, pool, test = (rows_of(embedded, part) for part in (task.initial, task.pool, task.test))
    assert sorted(initial + pool) == embedded.rows("train").tolist()
    assert test == embedded.rows("test").tolist()
    for part, rows in ((task.initial, initial), (task.pool, pool), (task.test, test)):
        assert part.concept_N.tolist() == embedded.concept[rows].tolist()
    assert count(task.initial) == {concept: 6 * (concept != held_out) for concept in CONCEPTS}
    assert count(task.pool) == {concept: 12 if concept == held_out else 6 for concept in CONCEPTS}


def test_a_rare_concept_has_its_share_of_the_pool_and_the_others_stay(embedded):
    common = make_task(embedded, "pose", SETTINGS, "tiny", 0)
    rare = make_task(embedded, "pose", SETTINGS, "tiny", 0, new_share=0.25)
    assert count(common.pool) == {"noise": 6, "pose": 12, "overlap": 6}
    assert count(rare.pool) == {"noise": 6, "pose": 4, "overlap": 6}
    assert set(rows_of(embedded, rare.pool)) <= set(rows_of(embedded, common.pool))
    assert rows_of(embedded, rare.initial) == rows_of(embedded, common.initial)
    assert rows_of(embedded, rare.test) == rows_of(embedded, common.test)


@pytest.mark.parametrize(("initial", "share", "left"), [(16, 0.2, (8, 2)), (16, 0.8, (8, 12)), (12, 0.1, (12, 1))])
def test_a_rare_concept_has_its_share_as_far_as_there_are_samples(embedded, initial, share, left):
    settings = dataclasses.replace(SETTINGS, initial=initial)
    counted = count(make_task(embedded, "overlap", settings, "tiny", 0, new_share=share).pool)
    assert (counted["noise"] + counted["pose"], counted["overlap"]) == left


@pytest.mark.parametrize(
    "labels, batch, expected",
    [(8, 4, [0, 4, 8]), (10, 4, [0, 4, 8, 10]), (3, 5, [0, 3]), (40, 10, [0, 10, 20, 24]), (0, 4, [0])],
)
def test_labels_are_spent_by_the_batch_up_to_the_budget_or_the_pools_end(task, gpc, labels, batch, expected):
    assert learned(task, gpc, "random", labels=labels, batch=batch)["labels"] == expected


@pytest.mark.parametrize("strategy", ["random", "bald_kmeans", "coreset"])
def test_the_concept_held_out_is_learned(task, gpc, strategy):
    steps = learned(task, gpc, strategy)
    assert (steps["accuracy_new"][0], steps["accuracy_new"][-1]) == (0.0, 1.0)
    assert steps["accuracy"][-1] > 0.9
    assert steps["epochs"][0] == 0
    assert all(0 < epochs <= SETTINGS.iterations for epochs in steps["epochs"][1:])


def recorded_queries(monkeypatch):
    """What each query of the strategy was shown, and which rows of it were chosen."""
    queries = []

    def select(name, pool, batch, random, select=gpca.active_learning.rounds.select):
        rows = select(name, pool, batch, random)
        queries.append((pool, rows))
        return rows

    monkeypatch.setattr(gpca.active_learning.rounds, "select", select)
    return queries


def test_a_strategy_is_shown_what_the_classifier_makes_of_the_pool_and_what_was_asked_leaves_it(monkeypatch, task, gpc):
    queries = recorded_queries(monkeypatch)
    learned(task, gpc, "bald")
    scores, _, bald = gpc.attribute(task.pool.h)
    assert np.array_equal(queries[0][0].scores_N_C, scores)
    assert np.array_equal(queries[0][0].bald_N, bald)
    assert queries[0][1].tolist() == np.argsort(-bald, kind="stable")[:4].tolist()
    assert [len(pool.h_N_d) for pool, _ in queries] == [24, 20, 16]
    assert [len(pool.h_labeled_L_d) for pool, _ in queries] == [12, 16, 20]
    for (pool, rows), (later, _) in pairwise(queries):
        assert np.array_equal(later.h_labeled_L_d[-4:], pool.h_N_d[rows])
        assert np.array_equal(later.h_N_d, np.delete(pool.h_N_d, rows, axis=0))
        assert np.array_equal(later.truth_N, np.delete(pool.truth_N, rows))


def test_the_first_classifier_knows_two_concepts_of_three_and_the_accuracy_without_test_samples_is_nan(task, gpc):
    assert gpc.classes == CONCEPTS
    known = np.flatnonzero(task.test.concept_N != "overlap")
    test = Samples(task.test.h[known], task.test.concept_N[known])
    steps = [step_of(each, gpc, [], epochs=0) for each in (task, dataclasses.replace(task, test=test))]
    assert [step["accuracy"] for step in steps] == [pytest.approx(2 / 3), 1.0]
    assert steps[0]["accuracy_new"] == 0.0 and np.isnan(steps[1]["accuracy_new"])
