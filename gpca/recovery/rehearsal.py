"""Before a policy decides: every action is tried on failures of the training tables, and thresholds are settled."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial

import numpy as np

from gpca.causes.policy import NOTHING, RecoveryPolicy
from gpca.recovery.actions import Action
from gpca.recovery.answers import Answer, Answers, CaseKey, Explain
from gpca.recovery.chances import FailureGate, Trial, learn_gate
from gpca.recovery.episodes import Episode
from gpca.recovery.policies import Means, Order, best_order
from gpca.recovery.settings import LoopSettings


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
    """Try every action on every failure, and where that did not help one more, each of the others in turn."""
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
    solved = [partial(episode.solved_by, by_name=actions, settings=settings) for episode in failures]
    return best_order(tuple(actions), costs, solved, settings.budget)


def rehearsed_gate(episodes: Mapping[str, Sequence[Episode]], false_alarms: float) -> FailureGate:
    """The gate that learned the first registrations of these episodes, by the part that their tables are of."""
    together = [(part, episode) for part, group in episodes.items() for episode in group]
    observed_N_F = np.array([episode.observe(()) for _, episode in together])
    failed_N = np.array([episode.failed for _, episode in together])
    return learn_gate(observed_N_F, failed_N, [(part, e.situation.table) for part, e in together], false_alarms)


def robot_policy(recovery: Mapping, rehearsal: Rehearsal | None) -> RecoveryPolicy:
    """The declared thresholds; that of uncertainty by the rehearsed failures unless declared, infinite without any."""
    bald_N = np.array([rehearsal.bald[episode.number] for episode in rehearsal.failures] if rehearsal else [np.inf])
    attempts = recovery["loop"]["budget"]
    return RecoveryPolicy.of_settings(recovery["thresholds"], recovery["treatments"], attempts, bald_N)


def summary(means: Means) -> dict:
    policy, gate = means.policy, means.gate
    thresholds = asdict(policy.thresholds) | ({"gate": gate.threshold} if gate else {})
    thresholds |= {"alarm": means.alarm} if means.alarm is not None else {}
    return {
        "thresholds": {name: round(value, 6) for name, value in thresholds.items()},
        "treatments": dict(policy.treatments),
        "order": list(means.order),
    }
