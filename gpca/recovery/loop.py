"""The closed loop: policies of recovery on the same failures, with the same budget of actions.

A failure is a registration whose pose is wrong (ADD, or ADD-S of symmetric objects, above 10 % of the diameter) and
whose cause is known: without it, the same registration succeeds. An action gives the same result whichever policy
takes it after the same actions, so what was tried once is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.alignment.pose_error import CORRECT
from gpca.attribution.scores import Attribution
from gpca.errors import InputError
from gpca.frames.situations import Situation, Situations
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.synthesis import as_registrations
from gpca.progress import progress
from gpca.recovery.actions import Action
from gpca.recovery.cases import Attempt, register_after, register_first
from gpca.recovery.policies import Case, policy_entry
from gpca.recovery.policy import QUEUE, RecoveryPolicy
from gpca.seeds import generator
from gpca.settings import Bounds, Count

if TYPE_CHECKING:
    import pandas as pd

Explain = Callable[[Registrations], Attribution]


@dataclass(frozen=True)
class LoopSettings:
    """How the closed loop runs.

    Attributes:
        failures: wanted for each cause. tries: registrations made for them, at most, for each cause.
        budget: actions for each failure, at most.
        cloud_points: of source and of target.
        icp: how ICP runs.
    """

    failures: Count = 8
    tries: Count = 120
    budget: Annotated[int, Bounds(minimum=1, maximum=9)] = 3
    cloud_points: int = 2048
    icp: ICPSettings = field(default_factory=ICPSettings)


class Episode:
    """A failure and everything that was tried about it.

    Args:
        number: its own among all of a run.
        tries: registrations that were made for all failures of its cause.
    """

    def __init__(self, number: int, situation: Situation, start: Attempt, tries: int) -> None:
        self.number, self.situation, self.tries = number, situation, tries
        self.outcomes: dict[tuple[str, ...], Attempt] = {(): start}

    def take(self, actions: tuple[str, ...], known: Mapping[str, Action], settings: LoopSettings) -> Attempt:
        """Return the outcome after these actions, of which all but the last were taken."""
        if actions not in self.outcomes:
            given = (self.situation, self.outcomes[actions[:-1]], known[actions[-1]], actions)
            self.outcomes[actions] = register_after(*given, settings.cloud_points, settings.icp)
        return self.outcomes[actions]


def find_failures(situations: Situations, settings: LoopSettings) -> list[Episode]:
    """Draw situations of every cause until enough of their registrations have failed for it.

    Raises:
        InputError: no failure at all.
    """
    episodes: list[Episode] = []
    tried: dict[str, int] = {}
    for cause in CONCEPTS:
        found: list[tuple[Situation, Attempt]] = []
        for number in progress(range(settings.tries), f"failures by {cause}"):
            if len(found) == settings.failures:
                break
            tried[cause] = number + 1
            disturbed, clean = situations.draw(cause, cause, number)
            start = register_first(disturbed, settings.cloud_points, settings.icp)
            if start is None or start.error <= CORRECT:
                continue
            without = register_first(clean, settings.cloud_points, settings.icp)
            if without is not None and without.error <= CORRECT:
                found.append((disturbed, start))
        episodes += [Episode(len(episodes) + n, *failure, tried[cause]) for n, failure in enumerate(found)]
    if not episodes:
        counts = ", ".join(f"{n} of {cause}" for cause, n in tried.items())
        raise InputError("recovery", f"no registration failed ({counts})", "raise recovery.tries or the disturbances")
    return episodes


class Loop:
    """All policies on all episodes, step by step, so that explainers see what is new in one batch.

    Args:
        episodes: the failures.
        actions: by name.
        explain: explainer -> what attributes registrations; of those that the policies read.
        policy: the robot's thresholds and treatments.
    """

    def __init__(
        self,
        episodes: Sequence[Episode],
        actions: Mapping[str, Action],
        explain: Mapping[str, Explain],
        policy: RecoveryPolicy,
        settings: LoopSettings,
        axes: tuple,
    ) -> None:
        self.episodes, self._actions, self._explain = episodes, actions, explain
        self._policy, self._settings, self._axes = policy, settings, axes
        self._said: dict[tuple, tuple[np.ndarray, float, float]] = {}

    def run(self, policies: Sequence[str]) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Return a row per episode, policy and step, and the seconds of each, in the same order."""
        import pandas as pd

        names = tuple(self._actions)
        entries = {name: policy_entry(name, names) for name in policies}
        decide = {name: entry.make(self._policy, names) for name, entry in entries.items()}
        taken: dict[tuple[int, str], tuple[str, ...]] = {
            (episode.number, name): () for episode in self.episodes for name in policies
        }
        rows, seconds = [], []
        for step in range(1, self._settings.budget + 1):
            self._explain_new({(entries[name].explainer, number, taken[number, name]) for number, name in taken})
            following = {}
            for episode in self.episodes:
                for name in policies:
                    if (key := (episode.number, name)) not in taken:
                        continue
                    row, time = self._step(episode, name, entries[name], decide[name], taken[key])
                    rows.append(row | {"step": step})
                    seconds.append({c: row[c] for c in ("episode", "policy")} | {"step": step} | time)
                    if row["action"] != QUEUE and not row["recovered"]:
                        following[key] = (*taken[key], row["action"])
            taken = following
        order = sorted(range(len(rows)), key=lambda n: (rows[n]["episode"], policies.index(rows[n]["policy"]), n))
        return pd.DataFrame([rows[n] for n in order]), pd.DataFrame([seconds[n] for n in order])

    def _step(self, episode: Episode, name: str, entry, decide, before: tuple[str, ...]) -> tuple[dict, dict]:
        history = [before[:n] for n in range(len(before) + 1)]
        said = [self._said[entry.explainer, episode.number, actions] for actions in history if entry.explainer]
        started = perf_counter()
        decision = decide(
            Case(
                actions=before,
                scores_T_C=np.array([scores_C for scores_C, *_ in said]) if said else None,
                bald_T=np.array([bald for _, bald, _ in said]) if said else None,
                cause=episode.situation.cause if entry.oracle else "",
                random=generator(*self._axes, "policy", episode.number),
            )
        )
        spent = perf_counter() - started + (said[-1][2] if said else 0.0)
        old, new, action_seconds = episode.outcomes[before], None, 0.0
        if decision.action != QUEUE:
            new = episode.take((*before, decision.action), self._actions, self._settings)
            action_seconds = new.seconds
        shelf, model = episode.situation.shelf, episode.situation.model
        scores = said[-1][0] if said else np.full(len(CONCEPTS), np.nan)
        row = {
            "episode": episode.number,
            "cause": episode.situation.cause,
            "object": shelf.objects.names[model],
            "symmetric": shelf.symmetric[model],
            "tries": episode.tries,
            "policy": name,
            "action": decision.action,
            "concept": decision.concept,
            **{f"score_{concept}": score for concept, score in zip(CONCEPTS, scores, strict=True)},
            "bald": said[-1][1] if said else np.nan,
            "error_before": old.error,
            "error_after": (new or old).error,
            "recovered": bool(new is not None and new.error <= CORRECT),
        }
        return row, {"explanation_seconds": spent, "action_seconds": action_seconds}

    def _explain_new(self, wanted: set[tuple]) -> None:
        """Explain the registrations that no explainer of that name has seen yet, in a fixed order.

        Their sample numbers, which name random numbers, tell episode and actions.
        """
        base = len(self._actions) + 1
        for explainer, explain in self._explain.items():
            new = sorted(key for key in wanted if key[0] == explainer and key not in self._said)
            if not new:
                continue
            records = []
            for _, number, actions in new:
                code = sum((1 + list(self._actions).index(a)) * base**place for place, a in enumerate(actions))
                record = self.episodes[number].outcomes[actions].record
                records.append(record | {"sample": base**self._settings.budget * number + code, "split": "test"})
            said = explain(as_registrations(records)[0].without_labels())
            shares_N_C = as_shares(said.scores_N_C)
            for key, *of_key in zip(new, shares_N_C, said.bald_N, said.seconds_N, strict=True):
                self._said[key] = (of_key[0], float(of_key[1]), float(of_key[2]))


def as_shares(scores_N_C: np.ndarray) -> np.ndarray:
    """Return scores that sum to one: as they are where they do, by softmax of signed ones, e.g. Shapley values."""
    from scipy.special import softmax

    shares = (scores_N_C >= 0).all() and np.allclose(scores_N_C.sum(axis=1), 1)
    return scores_N_C if shares else softmax(scores_N_C, axis=1)


def register_situations(
    situations: Mapping[str, Situations], train: int, calibration: int, settings: LoopSettings
) -> tuple[Registrations, np.ndarray]:
    """Register situations of all causes, failed or not: what the classifier learns from, and is calibrated on.

    Samples 3t to 3t + 2 of a split are of the three causes. The calibration samples are the split ``test``.

    Args:
        situations: of ``train`` and ``test``, which share no table.

    Returns:
        the registrations, and which of them failed (S,).
    """
    records, failed = [], []
    for split, count in (("train", train), ("test", calibration)):
        for number in progress(range(count), f"situations of split {split}"):
            cause, start, redraw = CONCEPTS[number % len(CONCEPTS)], None, 0
            while start is None:
                situation, _ = situations[split].draw(cause, cause, number, redraw)
                start, redraw = register_first(situation, settings.cloud_points, settings.icp), redraw + 1
            records.append(start.record | {"sample": number, "split": split})
            failed.append(start.error > CORRECT)
    return as_registrations(records)[0], np.array(failed)
