"""Before a policy decides: every action is tried on failures of the training tables, and thresholds are settled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from gpca.experiments.recovery.answers import Answer, Answers, CaseKey, Explain
from gpca.experiments.recovery.episodes import Episode
from gpca.recovery.actions import Action
from gpca.recovery.chances import FailureGate, Trial, learn_gate
from gpca.recovery.policies import Means, Order, best_order
from gpca.recovery.policy import NOTHING, RecoveryPolicy
from gpca.recovery.settings import LoopSettings

if TYPE_CHECKING:
    from gpca.experiments.recovery.loop_explainers import LoopExplainers


@dataclass(frozen=True)
class Rehearsal:
    """Episodes of the training tables.

    Attributes:
        episodes: those that failed, and those that did not.
        trials: of each by its number.
        bald: of each by its number, at its start, in nats.
    """

    episodes: Sequence[Episode]
    trials: Mapping[int, Sequence[Trial]]
    bald: Mapping[int, float] = field(default_factory=dict)

    @property
    def failures(self) -> list[Episode]:
        """The episodes that every action was tried on."""
        return [episode for episode in self.episodes if episode.failed]


def known(observed_F: np.ndarray, answer: Answer) -> np.ndarray:
    """Return all that a policy may weigh: the robot's observations; scores, variances and BALD of an explainer."""
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
        return known(episode.observe(sequence), answers.history(explainer, episode.number, sequence)[-1])

    trials = {e.number: [Trial(state(e, ()), NOTHING, not e.failed)] for e in episodes}
    for episode, sequence in taken:
        right = episode.solved_by(sequence, actions, settings)
        trials[episode.number].append(Trial(state(episode, sequence[:-1]), sequence[-1], right))
    return Rehearsal(episodes, trials, {e.number: answers.history(explainer, e.number, ())[0].bald for e in episodes})


def rehearsed_order(
    failures: Sequence[Episode], actions: Mapping[str, Action], costs: Mapping[str, float], settings: LoopSettings
) -> Order:
    """Return the order of all actions that recovers these failures soonest, see :func:`best_order`."""
    solved = [partial(_solved, episode, actions, settings) for episode in failures]
    return best_order(tuple(actions), costs, solved, settings.budget)


def _solved(episode: Episode, actions: Mapping[str, Action], settings: LoopSettings, taken: Order) -> bool:
    return episode.solved_by(taken, actions, settings)


def rehearsed_gate(episodes: Mapping[str, Sequence[Episode]], false_alarms: float) -> FailureGate:
    """Return the gate that learned the first registrations of these episodes, by the part that their tables are of."""
    together = [(part, episode) for part, of_part in episodes.items() for episode in of_part]
    observed_N_F = np.array([episode.observe(()) for _, episode in together])
    failed_N = np.array([episode.failed for _, episode in together])
    return learn_gate(observed_N_F, failed_N, [(part, e.situation.table) for part, e in together], false_alarms)


def robot_policy(recovery: Mapping, rehearsal: Rehearsal | None) -> RecoveryPolicy:
    """Return the declared thresholds, and the one that is chosen on the rehearsed failures unless it is declared.

    Those are found like the failures that policies are judged by, on other tables. Without a rehearsal no
    policy queues anything.

    Args:
        recovery: the config's section.
    """
    bald_N = np.array([rehearsal.bald[episode.number] for episode in rehearsal.failures] if rehearsal else [np.inf])
    attempts = recovery["loop"]["budget"]
    return RecoveryPolicy.of_settings(recovery["thresholds"], recovery["treatments"], attempts, bald_N)


def summary(means: Means, explainers: LoopExplainers) -> dict:
    """Return thresholds, treatments, order and the explainers' accuracy on the calibration samples, for JSON."""
    policy, gate = means.policy, means.gate
    thresholds = asdict(policy.thresholds) | ({"gate": gate.threshold} if gate else {})
    thresholds |= {"alarm": means.alarm} if means.alarm is not None else {}
    return {
        "thresholds": {name: round(value, 6) for name, value in thresholds.items()},
        "treatments": dict(policy.treatments),
        "order": list(means.order),
        "calibration_samples": len(explainers.concepts),
        "calibration_accuracy": {
            name: round(float(explainers.right(name).mean()), 6) for name in explainers.calibration
        },
    }
