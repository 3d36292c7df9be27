"""What is rehearsed before policies decide, and the closed loop: all on the same registrations, with one budget."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache
from time import perf_counter

import numpy as np
import pandas as pd

from gpca.causes.policy import NOTHING, QUEUE, Decision, RecoveryPolicy
from gpca.causes.settings import CauseSettings
from gpca.errors import InputError, require_known
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.recovery.actions import Action, Holding, Robot
from gpca.recovery.answers import Answer, Answers, Explain
from gpca.recovery.chances import FailureGate, Trial, alarm_threshold, learn_gate
from gpca.recovery.episodes import Episode
from gpca.recovery.policies import Case, Means, PolicyEntry, policy_entry
from gpca.recovery.reenactment import Belief, CauseEffects, KnownModel, believe, reenact
from gpca.recovery.settings import LoopSettings
from gpca.reenactment.settings import ReenactmentSettings
from gpca.seeds import generator

Taken = tuple[str, ...]
NO_SCORES = np.full(len(CONCEPTS), np.nan)
UNEXPLAINED = Answer(NO_SCORES, NO_SCORES, np.nan, 0.0)


@dataclass(frozen=True)
class Rehearsal:
    """Episodes of the training tables: those that failed, on which every action was tried, and those that did not."""

    episodes: Sequence[Episode]
    trials: Mapping[int, Sequence[Trial]]  # of each by its number
    bald: Mapping[int, float] = field(default_factory=dict)  # of each by its number, at its start, in nats


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
    answers.ask((explainer, episode.number, ()) for episode in episodes)
    answers.ask((explainer, episode.number, sequence[:-1]) for episode, sequence in taken)

    def state(episode: Episode, sequence: tuple[str, ...]) -> np.ndarray:
        return policy_inputs(episode.observe(sequence), answers.history(explainer, episode.number, sequence)[-1])

    trials = {e.number: [Trial(state(e, ()), NOTHING, not e.failed)] for e in episodes}
    for episode, sequence in taken:
        right = episode.solved_by(sequence, actions, settings)
        trials[episode.number].append(Trial(state(episode, sequence[:-1]), sequence[-1], right))
    return Rehearsal(episodes, trials, {e.number: answers.history(explainer, e.number, ())[0].bald for e in episodes})


def rehearsed_gate(episodes: Mapping[str, Sequence[Episode]], false_alarms: float) -> FailureGate:
    """The gate that learned the first registrations of these episodes, by the part that their tables are of."""
    together = [(part, episode) for part, group in episodes.items() for episode in group]
    observed_N_F = np.array([episode.observe(()) for _, episode in together])
    failed_N = np.array([episode.failed for _, episode in together])
    return learn_gate(observed_N_F, failed_N, [(part, e.situation.table) for part, e in together], false_alarms)


def robot_policy(recovery: Mapping, rehearsal: Rehearsal | None) -> RecoveryPolicy:
    """The declared thresholds; that of uncertainty by the rehearsed failures unless declared, infinite without any."""
    bald_N = np.array([rehearsal.bald[e.number] for e in rehearsal.episodes if e.failed] if rehearsal else [np.inf])
    attempts = recovery["loop"]["budget"]
    return RecoveryPolicy.of_settings(recovery["thresholds"], recovery["treatments"], attempts, bald_N)


def summary(means: Means) -> dict:
    policy, gate = means.policy, means.gate
    thresholds = asdict(policy.thresholds) | ({"gate": gate.threshold} if gate else {})
    thresholds |= {"alarm": means.alarm} if means.alarm is not None else {}
    rounded = {name: round(value, 6) for name, value in thresholds.items()}
    return {"thresholds": rounded, "treatments": dict(policy.treatments), "order": list(means.order)}


class Reenactor:
    """Re-enacts registrations of episodes after actions, which were taken, on the tables of one run, each once."""

    def __init__(self, settings: ReenactmentSettings, counterfactuals: CauseSettings) -> None:
        self._settings, self._counterfactuals = settings, counterfactuals
        self._models: dict[int, KnownModel] = {}
        self.believe, self.reenact = cache(self._believe), cache(self._reenact)

    def _believe(self, episode: Episode, actions: Taken) -> Belief:
        holding, model, axes = self._case(episode, actions)
        return believe(holding, model, self._settings, self._counterfactuals, axes)

    def _reenact(self, episode: Episode, actions: Taken) -> CauseEffects:
        holding, model, axes = self._case(episode, actions)
        return reenact(self.believe(episode, actions), holding, model, self._counterfactuals, axes)

    def _case(self, episode: Episode, actions: Taken) -> tuple[Holding, KnownModel, tuple]:
        model = episode.situation.model
        if model not in self._models:
            name = episode.situation.shelf.objects.names[model]
            self._models[model] = KnownModel.of(Robot(episode.situation), generator("known model", name))
        axes = (*episode.situation.axes, "re-enactment", *actions)
        return episode.outcomes[actions].holding, self._models[model], axes


def calibrated_alarm(episodes: Iterable[Episode], reenactor: Reenactor, false_alarms: float) -> float:
    """The probability of a failure that a further good registration exceeds with this probability, set on good ones."""
    good = [episode for episode in episodes if not episode.failed]
    if not good:
        fault = "has no good registration by which the alarm of the re-enactment can be set"
        raise InputError("recovery", fault, "raise recovery.calibration or recovery.rehearsals")
    failures = [reenactor.believe(each, ()).failure for each in progress(good, "good registrations for the alarm")]
    return alarm_threshold(np.array(failures), false_alarms)


@dataclass
class Loop:
    """All policies on all episodes, failed or not, step by step, so that explainers see what is new in one batch."""

    episodes: Sequence[Episode]  # failed or not
    actions: Mapping[str, Action]
    explain: Mapping[str, Explain]  # for each explainer that the policies read, what attributes registrations
    means: Means
    settings: LoopSettings
    axes: tuple
    reenactor: Reenactor

    def run(self, policies: Sequence[str]) -> tuple[pd.DataFrame, pd.DataFrame]:
        """A row per episode, policy and step, and the seconds of each, in the same order."""
        entries = {name: policy_entry(name, tuple(self.actions)) for name in policies}
        answers = Answers(self.episodes, self.explain, tuple(self.actions), self.settings.budget)
        taken: dict[tuple[int, str], Taken] = {(e.number, name): () for e in self.episodes for name in policies}
        rows, seconds = [], []
        for step in range(1, self.settings.budget + 1):
            answers.ask((entries[name].explainer, n, actions) for (n, name), actions in taken.items())
            following = {}
            for episode in self.episodes:
                for name in policies:
                    if (key := (episode.number, name)) not in taken:
                        continue
                    entry, before = entries[name], taken[key]
                    history = answers.history(entry.explainer, episode.number, before) if entry.explainer else []
                    row, time = self._step(episode, name, entry, before, history)
                    rows.append(row | {"step": step})
                    seconds.append({c: row[c] for c in ("episode", "failed", "policy")} | {"step": step} | time)
                    if row["failed"] and row["action"] in self.actions and not row["recovered"]:
                        following[key] = (*before, row["action"])
            taken = following
        order = sorted(range(len(rows)), key=lambda n: (rows[n]["episode"], policies.index(rows[n]["policy"]), n))
        return pd.DataFrame([rows[n] for n in order]), pd.DataFrame([seconds[n] for n in order])

    def _decision(self, name: str, entry: PolicyEntry, case: Case) -> Decision:
        decision, subject = entry.decide(case, self.means), f"recovery policy '{name}'"
        if not isinstance(decision, Decision) or not all(isinstance(text, str) for text in vars(decision).values()):
            raise InputError(subject, f"returns a {type(decision).__name__}", "make it return a Decision of texts")
        actions = (*self.actions, *self.means.policy.treatments.values(), QUEUE, NOTHING)
        require_known(f"{subject}: action", decision.action, actions)
        require_known(f"{subject}: concept", decision.concept, (*CONCEPTS, ""))
        return decision

    def _step(
        self, episode: Episode, name: str, entry: PolicyEntry, before: Taken, history: Sequence[Answer]
    ) -> tuple[dict, dict]:
        reenacted = self.reenactor.reenact(episode, before) if entry.reenacts else None
        started = perf_counter()
        case = Case(
            actions=before,
            scores_T_C=np.array([answer.scores_C for answer in history]) if history else None,
            bald_T=np.array([answer.bald for answer in history]) if history else None,
            observed_F=episode.observe(()) if entry.gated else None,
            known_F=policy_inputs(episode.observe(before), history[-1]) if entry.learns else None,
            cause=episode.situation.cause if entry.oracle and episode.failed else "",
            random=generator(*self.axes, "policy", episode.number),
            reenacted=reenacted,
        )
        decision = self._decision(name, entry, case)
        spent = perf_counter() - started + (reenacted.seconds if reenacted else 0.0)
        last = history[-1] if history else UNEXPLAINED
        old, new, action_seconds, recovered = episode.outcomes[before], None, 0.0, False
        if episode.failed and decision.action in self.actions:
            after = (*before, decision.action)
            new = episode.take(after, self.actions, self.settings)
            action_seconds, recovered = new.seconds, episode.is_right(after)
        situation = episode.situation
        row = {
            "episode": episode.number,
            "cause": situation.cause,
            "object": situation.shelf.objects.names[situation.model],
            "symmetric": situation.shelf.symmetric[situation.model],
            "table": situation.table,
            "tries": episode.tries,
            "failed": episode.failed,
            "policy": name,
            "action": decision.action,
            "concept": decision.concept,
            **dict(zip((f"score_{concept}" for concept in CONCEPTS), last.scores_C, strict=True)),
            "bald": last.bald,
            "error_before": old.error,
            "error_after": (new or old).error,
            "recovered": recovered,
        }
        return row, {"explanation_seconds": spent + last.seconds, "action_seconds": action_seconds}
