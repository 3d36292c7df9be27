"""Rounds in which the classifier is fitted to all labels: what it learns from, how labels and epochs are counted."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gpca.active_learning import retraining as module
from gpca.active_learning.retraining import Retraining, learn
from gpca.active_learning.rounds import make_task
from gpca.active_learning.settings import LOOK_EVERY, ActiveLearningSettings, RetrainingSettings
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.io.files import SPLITS
from gpca.pairs.perturbation import CONCEPTS

QUICK = GPCSettings(learning_rate=0.1, iterations=12, inducing=6, draws=50)
ROUNDS = RetrainingSettings(labels=12, least=8, batch=4, late_batch=2, gpc=QUICK)


@pytest.fixture(scope="module")
def task():
    """Three clusters of 30 samples, of which the third is new; two thirds of each are for training."""
    random = np.random.default_rng(0)
    concept_S = np.repeat(CONCEPTS, 30)
    h_S_d = (3 * np.repeat(np.eye(3, 5), 30, axis=0) + random.normal(size=(90, 5))).astype(np.float32)
    split_S = np.where(np.arange(90) % 3 == 0, "test", "train")
    rows = {split: np.flatnonzero(split_S == split) for split in SPLITS}
    samples = SimpleNamespace(embedding=h_S_d, concept=concept_S, rows=rows.get)
    return make_task(samples, "overlap", ActiveLearningSettings(initial=12), "tiny", 0, new_share=0.3)


@pytest.fixture(scope="module")
def cold(task):
    return Retraining(task, QUICK, "tiny", 0)


def accuracies_of(retraining, queried, counts):
    return {n: retraining.look(retraining.fit(queried[:n], None), queried[:n])["accuracy"] for n in counts}


@pytest.fixture(scope="module")
def of_rounds(cold):
    """A curve to a target that is out of reach: its rounds alone."""
    return learn(cold, "random", ROUNDS, [1.01], "tiny", 0)


def test_a_round_fits_the_classifier_to_all_labels_and_to_nothing_else(task, cold):
    rows = [3, 1, 7]
    h_L_d = np.concatenate([task.initial.h, task.pool.h[rows]])
    concept_L = np.concatenate([task.initial.concept_N, task.pool.concept_N[rows]])
    plain = GPC(CONCEPTS, QUICK, "tiny", 0, "retraining", "overlap").fit(h_L_d, concept_L)
    fitted, seen = (one.fit(rows, None) for one in (cold, Retraining(task, QUICK, "tiny", 0, sees_pool=True)))
    assert np.array_equal(fitted.attribute(task.test.h)[0], plain.attribute(task.test.h)[0])
    assert np.abs(seen.attribute(task.test.h)[0] - plain.attribute(task.test.h)[0]).max() > 1e-3


def test_a_warm_start_goes_on_from_the_classifier_before_and_leaves_it_as_it_was(task, cold):
    before = cold.fit([], None)
    scores = before.attribute(task.test.h)[0]
    still = Retraining(task, replace(QUICK, learning_rate=1e-7, iterations=1), "tiny", 0, warm=True)
    assert still.fit([0, 1], before).attribute(task.test.h)[0] == pytest.approx(scores, abs=1e-4)
    moved = Retraining(task, QUICK, "tiny", 0, warm=True).fit([0, 1], before)
    assert np.abs(moved.attribute(task.test.h)[0] - scores).max() > 1e-2
    assert np.array_equal(before.attribute(task.test.h)[0], scores)


def test_rounds_are_small_up_to_the_least_labels_and_end_with_the_budget(cold, of_rounds):
    assert [step["labels"] for step in of_rounds.steps] == [0, 4, 8, 10, 12]
    assert [step["epochs"] for step in of_rounds.steps] == [0, 12, 12, 12, 12]
    assert len(set(of_rounds.queried)) == 12
    assert of_rounds.labels_to(1.01) == of_rounds.queried
    learned = learn(cold, "random", ROUNDS, [0.1], "tiny", 0)  # reached at the start, which costs no label
    assert (learned.labels_to(0.1), learned.steps[-1]["labels"]) == ([], ROUNDS.least)


def test_the_labels_of_the_round_that_reaches_the_target_are_counted_one_by_one(cold, of_rounds):
    """A strategy that reads no scores asks for the same samples whatever the target."""
    seen = accuracies_of(cold, of_rounds.queried, range(13))
    rounds = [0, 4, 8, 10, 12]
    target = max(seen[n] for n in rounds)
    reached = next(n for n in rounds if seen[n] >= target)
    first = next(n for n in range(rounds[rounds.index(reached) - 1] + 1, reached + 1) if seen[n] >= target)
    learned = learn(cold, "random", ROUNDS, [target], "tiny", 0)
    expected = [n for n in sorted({*rounds, first}) if n <= max(reached, ROUNDS.least)]
    assert [step["labels"] for step in learned.steps] == expected
    assert [step["accuracy"] for step in learned.steps] == [seen[n] for n in expected]
    assert learned.labels_to(target) == of_rounds.queried[:first]
    [epochs] = [step["epochs"] for step in learned.steps if step["labels"] == first]
    assert epochs == cold.passes(target, of_rounds.queried[:first], None)
    assert epochs == QUICK.iterations or epochs % LOOK_EVERY == 0


def test_passes_are_the_first_with_the_accuracy(task, cold):
    rows = list(range(10))
    accuracies = {done: cold.look(gpc, rows)["accuracy"] for done, gpc in cold.fit_up_to([5, 10, 12], rows, None)}
    target = max(accuracies.values())
    assert cold.passes(target, rows, None) == next(done for done, value in accuracies.items() if value >= target)
    assert cold.passes(1.01, rows, None) == QUICK.iterations


def test_every_target_has_a_step_and_the_round_is_looked_through_once(task, monkeypatch):
    """The accuracies are made up: 0.5 at the start, then 0.1 more with each label."""
    fits = []

    class Counted(Retraining):
        def fit(self, queried, before):
            fits.append(len(queried))
            return fitted

        def look(self, gpc, queried):
            return {"labels": len(queried), "accuracy": round(0.5 + 0.1 * len(queried), 1), "epochs": 1}

    fitted = Retraining(task, QUICK, "tiny", 0).fit([], None)
    learned = learn(Counted(task, QUICK, "tiny", 0), "random", ROUNDS, [0.6, 0.8], "tiny", 0)
    assert [step["labels"] for step in learned.steps] == [0, 1, 3, 4, 8]
    assert fits == [0, 4, 1, 2, 3, 8]


def test_bald_is_told_the_classifier_of_each_round(task, cold, monkeypatch):
    asked = []

    def recorded(name, pool, batch, random, select=module.select):
        asked.append(pool)
        return select(name, pool, batch, random)

    monkeypatch.setattr(module, "select", recorded)
    learned = learn(cold, "bald_kmeans", replace(ROUNDS, labels=8), [1.01], "tiny", 0)
    for pool, given in zip(asked, (0, 4), strict=True):
        rows = learned.queried[:given]
        gpc = cold.fit(rows, None)
        left = np.setdiff1d(np.arange(len(task.pool)), rows)
        assert np.array_equal(pool.bald_N, gpc.attribute(task.pool.h[left])[2])
