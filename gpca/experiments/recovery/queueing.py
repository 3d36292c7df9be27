"""Learning from queued cases: the error on other failures, by the number of cases that a person has labeled.

A label is what solved the case: its cause for the classifier, the outcome of every action for the learned chances.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from gpca.experiments.recovery.answers import answers_of, starts_of
from gpca.experiments.recovery.episodes import Episode
from gpca.experiments.recovery.loop_explainers import LoopExplainers
from gpca.experiments.recovery.metrics import DOUBTED, DRAWN, QUEUE_COLUMNS
from gpca.experiments.recovery.rehearsal import Rehearsal, known
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.chances import ExpectedUtility, Trial, learn_utility
from gpca.recovery.policies import Means, policy_entry
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

BATCH = 4  # cases that are labeled before anything is learned from them
DRAWS = 5  # random orders


class QueueLearner(Protocol):
    """A learner that doubts queued cases, learns their labels, and decides about others."""

    def doubts(self) -> np.ndarray:
        """Return the doubt about each queued case (N,)."""

    def learn(self, rows: np.ndarray) -> None:
        """Learn the labels of these cases."""

    def choose(self) -> list[str]:
        """Return the learner's first action for each of the failures that it is judged by."""


class ClassifierLearner:
    """Treats what the classifier names; its doubt is BALD.

    Args:
        explainer: a fitted one that can learn further labels; it stays as it is.
        queued, judged: registrations with what the explainer reads.
        treatments: concept -> action.
    """

    def __init__(
        self, explainer: Any, queued: Registrations, judged: Registrations, treatments: Mapping[str, str]
    ) -> None:
        self._explainer = deepcopy(explainer)
        self._queued, self._judged, self._treatments = queued, judged, treatments

    def doubts(self) -> np.ndarray:
        """Return BALD in nats."""
        return self._explainer.explain(self._queued.without_labels()).bald_N

    def learn(self, rows: np.ndarray) -> None:
        """Learn the causes."""
        self._explainer.learn(self._queued.subset(rows))

    def choose(self) -> list[str]:
        """Return the treatments of the largest scores."""
        attribution = self._explainer.explain(self._judged.without_labels())
        return [self._treatments[CONCEPTS[column]] for column in attribution.scores_N_C.argmax(axis=1)]


class ChancesLearner:
    """Takes the action that is worth most; its doubt is how little the best one may help.

    Args:
        trials: of each queued case; the first tells what was known at its start.
        judged_N_F: the known features of the failures that it is judged by.
        costs: action -> its cost.
    """

    def __init__(
        self, trials: Sequence[Sequence[Trial]], judged_N_F: Sequence[np.ndarray], costs: Mapping[str, float]
    ) -> None:
        self._trials, self._judged_N_F, self._costs = trials, judged_N_F, costs
        self._learned: list[int] = []

    def _utility(self) -> ExpectedUtility:
        return learn_utility([self._trials[row] for row in self._learned], self._costs, tuple(self._costs))

    def doubts(self) -> np.ndarray:
        """Return the probability that the best action does not help."""
        chances = self._utility().chances
        return np.array([1 - max(chances.of(a, trials[0].known_F) for a in self._costs) for trials in self._trials])

    def learn(self, rows: np.ndarray) -> None:
        """Learn which actions helped."""
        self._learned += rows.tolist()

    def choose(self) -> list[str]:
        """Return the actions of the largest gains."""
        utility = self._utility()
        gains_N = [utility.gains(known_F, 0.0) for known_F in self._judged_N_F]
        return [max(gains, key=gains.__getitem__) for gains in gains_N]


def learners_of(
    policies: Sequence[str],
    means: Means,
    rehearsal: Rehearsal | None,
    judged: Sequence[Episode],
    explainers: LoopExplainers,
    budget: int,
) -> dict[str, Callable[[], QueueLearner]]:
    """Return the makers of the learners, for those of these policies that queue cases or learn from rehearsals.

    Args:
        rehearsal: its failures are the queued cases; None where no policy learns.
        judged: other failures.
        budget: how many actions a failure may take.
    """
    if rehearsal is None:
        return {}
    queued = rehearsal.failures
    trials = [rehearsal.trials[episode.number] for episode in queued]
    entries = {name: policy_entry(name, means.actions) for name in policies}
    learners: dict[str, Callable[[], QueueLearner]] = {}
    for name, entry in entries.items():
        if not (entry.learns or entry.queues) or any(entry.learns and entries[other].learns for other in learners):
            continue  # policies of the same chances learn the same
        starts = [starts_of(episodes, means.actions, budget) for episodes in (queued, judged)]
        if entry.queues:
            own, others = (explainers.attach[entry.explainer](registrations) for registrations in starts)
            fitted, treatments = explainers.fitted[entry.explainer], means.policy.treatments
            learners[name] = partial(ClassifierLearner, fitted, own, others, treatments)
        elif means.utility is not None:
            answers = answers_of(explainers.explain[entry.explainer](starts[1].without_labels()))
            known_N_F = [known(e.observe(()), answer) for e, answer in zip(judged, answers, strict=True)]
            learners[name] = partial(ChancesLearner, trials, known_N_F, means.utility.costs)
    return learners


def error_by_labels(
    learners: Mapping[str, Callable[[], QueueLearner]],
    solved: Sequence[Mapping[str, bool]],
    rehearsal: Rehearsal | None,
    axes: tuple,
) -> pd.DataFrame:
    """Return a row per learner, order and number of labels: how many of the judged failures its first action leaves.

    Args:
        learners: the maker of each by its name, without any label learned.
        solved: of each judged failure, whether each action solves it.
        rehearsal: its failures are the queued cases.
        axes: names of the random orders.
    """
    import pandas as pd

    rows: list[tuple] = []
    queued = len(rehearsal.failures) if rehearsal else 0
    for name, make in learners.items():
        for order, draw in ((DOUBTED, 0), *((DRAWN, draw) for draw in range(DRAWS))):
            learner, left = make(), generator(*axes, "queue", draw).permutation(queued)
            for labels in range(0, queued + 1, BATCH):
                chosen = learner.choose()
                unsolved = sum(not of[action] for of, action in zip(solved, chosen, strict=True))
                rows.append((name, order, draw, labels, len(solved), unsolved))
                if order == DOUBTED:
                    left = left[np.argsort(-learner.doubts()[left], kind="stable")]
                if len(left):
                    learner.learn(left[:BATCH])
                left = left[BATCH:]
    return pd.DataFrame(rows, columns=[*QUEUE_COLUMNS])
