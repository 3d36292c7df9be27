"""Before a policy decides: every action is tried on failures of the training tables, and thresholds are settled.

The rehearsed failures also serve as queued cases, whose label is what solved them: cause, or outcome of each action.
"""

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from gpca.causes.policy import DOUBTED, DRAWN, NOTHING, QUEUE_COLUMNS, RecoveryPolicy
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.actions import Action
from gpca.recovery.answers import Answer, Answers, CaseKey, Explain, LoopExplainers, answers_of, starts_of
from gpca.recovery.chances import ExpectedUtility, FailureGate, Trial, learn_gate, learn_utility
from gpca.recovery.episodes import Episode
from gpca.recovery.policies import Means, Order, best_order, policy_entry
from gpca.recovery.settings import LoopSettings
from gpca.seeds import generator

BATCH = 4  # cases that are labeled before anything is learned from them
DRAWS = 5  # random orders


@dataclass(frozen=True)
class Rehearsal:
    """Episodes of the training tables: those that failed, on which every action was tried, and those that did not."""

    episodes: Sequence[Episode]
    trials: Mapping[int, Sequence[Trial]]  # of each by its number
    bald: Mapping[int, float] = field(default_factory=dict)  # of each by its number, at its start, in nats

    @property
    def failures(self) -> list[Episode]:
        """Those that failed."""
        return [episode for episode in self.episodes if episode.failed]


def policy_inputs(observed_F: np.ndarray, answer: Answer) -> np.ndarray:
    """All that a policy may weigh: the robot's observations; scores, variances and BALD of an explainer."""
    return np.concatenate([observed_F, np.nan_to_num([*answer.scores_C, *answer.variances_C, answer.bald])])


def rehearse(
    episodes: Sequence[Episode], actions: Mapping[str, Action], explainer: str, explain: Explain, settings: LoopSettings
) -> Rehearsal:
    """Try every action on every failure, and one more where that did not help.

    The second action is each of the others in turn. Registrations that did not fail get no action.
    """
    names = tuple(actions)
    taken: list[tuple[Episode, tuple[str, ...]]] = []
    for episode in episodes:
        for n, first in enumerate(names if episode.failed else ()):
            taken.append((episode, (first,)))
            others = [name for name in names if name != first]
            if others and settings.budget > 1 and not episode.solved_by((first,), actions, settings):
                taken.append((episode, (first, others[(episode.number + n) % len(others)])))
    answers = Answers(episodes, {explainer: explain}, names, settings.budget)
    answers.ask(CaseKey(explainer, episode.number, ()) for episode in episodes)
    answers.ask(CaseKey(explainer, episode.number, sequence[:-1]) for episode, sequence in taken)

    def state(episode: Episode, sequence: tuple[str, ...]) -> np.ndarray:
        return policy_inputs(episode.observe(sequence), answers.history(explainer, episode.number, sequence)[-1])

    trials = {e.number: [Trial(state(e, ()), NOTHING, not e.failed)] for e in episodes}
    for episode, sequence in taken:
        right = episode.solved_by(sequence, actions, settings)
        trials[episode.number].append(Trial(state(episode, sequence[:-1]), sequence[-1], right))
    return Rehearsal(episodes, trials, {e.number: answers.history(explainer, e.number, ())[0].bald for e in episodes})


def rehearsed_order(
    failures: Sequence[Episode], actions: Mapping[str, Action], costs: Mapping[str, float], settings: LoopSettings
) -> Order:
    """The order of all actions that recovers these failures soonest, see :func:`best_order`."""
    solved = [partial(episode.solved_by, by_name=actions, settings=settings) for episode in failures]
    return best_order(tuple(actions), costs, solved, settings.budget)


def rehearsed_gate(episodes: Mapping[str, Sequence[Episode]], false_alarms: float) -> FailureGate:
    """The gate that learned the first registrations of these episodes, by the part that their tables are of."""
    together = [(part, episode) for part, group in episodes.items() for episode in group]
    observed_N_F = np.array([episode.observe(()) for _, episode in together])
    failed_N = np.array([episode.failed for _, episode in together])
    return learn_gate(observed_N_F, failed_N, [(part, e.situation.table) for part, e in together], false_alarms)


def robot_policy(recovery: Mapping, rehearsal: Rehearsal | None) -> RecoveryPolicy:
    """The thresholds that the section declares, and that of uncertainty by the rehearsed failures unless declared.

    Without a rehearsal no policy queues anything.
    """
    bald_N = np.array([rehearsal.bald[episode.number] for episode in rehearsal.failures] if rehearsal else [np.inf])
    attempts = recovery["loop"]["budget"]
    return RecoveryPolicy.of_settings(recovery["thresholds"], recovery["treatments"], attempts, bald_N)


def summary(means: Means, explainers: LoopExplainers) -> dict:
    """Thresholds, treatments, order and the explainers' accuracy on the calibration samples, for JSON."""
    policy, gate = means.policy, means.gate
    thresholds = asdict(policy.thresholds) | ({"gate": gate.threshold} if gate else {})
    thresholds |= {"alarm": means.alarm} if means.alarm is not None else {}
    return {
        "thresholds": {name: round(value, 6) for name, value in thresholds.items()},
        "treatments": dict(policy.treatments),
        "order": list(means.order),
        "calibration_samples": len(explainers.concepts),
        "calibration_accuracy": {n: round(float(explainers.right(n).mean()), 6) for n in explainers.calibration},
    }


class ClassifierLearner:
    """Treats what a fitted classifier, which is not changed but learns labels in a copy, names; its doubt is BALD."""

    def __init__(
        self, explainer: Any, queued: Registrations, judged: Registrations, treatments: Mapping[str, str]
    ) -> None:
        self._explainer = deepcopy(explainer)
        self._queued, self._judged, self._treatments = queued, judged, treatments

    def doubts(self) -> np.ndarray:
        """BALD (N,) in nats, of the queued cases."""
        return self._explainer.explain(self._queued.without_labels()).bald_N

    def learn(self, rows: np.ndarray) -> None:
        """Learn the causes of these cases."""
        self._explainer.learn(self._queued.subset(rows))

    def choose(self) -> list[str]:
        """The treatments of the largest scores of the failures that it is judged by."""
        attribution = self._explainer.explain(self._judged.without_labels())
        return [self._treatments[CONCEPTS[column]] for column in attribution.scores_N_C.argmax(axis=1)]


@dataclass
class ChancesLearner:
    """Takes the action that is worth most by what was known at the start; it doubts where the best may not help."""

    trials: Sequence[Sequence[Trial]]  # of each queued case
    judged_N_F: Sequence[np.ndarray]
    costs: Mapping[str, float]
    _learned: list[int] = field(default_factory=list)

    def _utility(self) -> ExpectedUtility:
        return learn_utility([self.trials[row] for row in self._learned], self.costs, tuple(self.costs))

    def doubts(self) -> np.ndarray:
        """The probability that the best action does not help."""
        chances = self._utility().chances
        return np.array([1 - max(chances.of(a, trials[0].known_F) for a in self.costs) for trials in self.trials])

    def learn(self, rows: np.ndarray) -> None:
        """Learn which actions helped."""
        self._learned += rows.tolist()

    def choose(self) -> list[str]:
        """The actions of the largest gains."""
        utility = self._utility()
        gains_N = [utility.gains(known_F, 0.0) for known_F in self.judged_N_F]
        return [max(gains, key=gains.__getitem__) for gains in gains_N]


QueueLearner = ClassifierLearner | ChancesLearner


def learners_of(
    policies: Sequence[str],
    means: Means,
    rehearsal: Rehearsal | None,
    judged: Sequence[Episode],
    explainers: LoopExplainers,
    budget: int,
) -> dict[str, Callable[[], QueueLearner]]:
    """The makers of the learners, for those of these policies that queue rehearsed failures or learn from them."""
    if rehearsal is None:
        return {}
    queued = rehearsal.failures
    entries = {name: policy_entry(name, means.actions) for name in policies}
    learners: dict[str, Callable[[], QueueLearner]] = {}
    for name, entry in entries.items():
        if not (entry.learns or entry.queues) or any(entry.learns and entries[other].learns for other in learners):
            continue  # policies of the same chances learn the same
        starts = [starts_of(episodes, means.actions, budget) for episodes in (queued, judged)]
        if entry.queues:
            queue, others = map(explainers.attach[entry.explainer], starts)
            fitted, treatments = explainers.fitted[entry.explainer], means.policy.treatments
            learners[name] = partial(ClassifierLearner, fitted, queue, others, treatments)
        elif means.utility is not None:
            answers = answers_of(explainers.explain[entry.explainer](starts[1].without_labels()))
            known_N_F = [policy_inputs(e.observe(()), answer) for e, answer in zip(judged, answers, strict=True)]
            trials = [rehearsal.trials[episode.number] for episode in queued]
            learners[name] = partial(ChancesLearner, trials, known_N_F, means.utility.costs)
    return learners


def error_by_labels(
    learners: Mapping[str, Callable[[], QueueLearner]],
    solved: Sequence[Mapping[str, bool]],
    rehearsal: Rehearsal | None,
    axes: tuple,
) -> pd.DataFrame:
    """A row per learner, order and number of labels: how many of the judged failures its first action leaves.

    `solved` says of each whether each action solves it; the axes name the random orders of the queued cases.
    """
    rows: list[tuple] = []
    queued = len(rehearsal.failures) if rehearsal else 0
    for name, make in learners.items():
        for order, draw in ((DOUBTED, 0), *((DRAWN, draw) for draw in range(DRAWS))):
            learner, left = make(), generator(*axes, "queue", draw).permutation(queued)
            for labels in range(0, queued + 1, BATCH):
                chosen = learner.choose()
                unsolved = sum(not helped[action] for helped, action in zip(solved, chosen, strict=True))
                rows.append((name, order, draw, labels, len(solved), unsolved))
                if order == DOUBTED:
                    left = left[np.argsort(-learner.doubts()[left], kind="stable")]
                if len(left):
                    learner.learn(left[:BATCH])
                left = left[BATCH:]
    return pd.DataFrame(rows, columns=[*QUEUE_COLUMNS])
