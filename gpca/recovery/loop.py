"""The closed loop: policies of recovery on the same failures, with the same budget of actions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.pose_error import CORRECT
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.actions import Action
from gpca.recovery.answers import Answer, Answers, CaseKey, Explain
from gpca.recovery.episodes import Episode
from gpca.recovery.policies import Case, Decide, PolicyEntry, policy_entry
from gpca.recovery.policy import QUEUE, RecoveryPolicy
from gpca.recovery.settings import LoopSettings
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd


class Loop:
    """All policies on all episodes, step by step, so that explainers see what is new in one batch.

    Args:
        episodes: the failures.
        actions: each by its name.
        explain: for each explainer that the policies read, the function that attributes registrations.
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
        self.episodes = episodes
        self._actions = actions
        self._policy = policy
        self._settings = settings
        self._axes = axes
        self._answers = Answers(episodes, explain, tuple(actions), settings.budget)

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
            self._answers.ask(
                CaseKey(entries[name].explainer, number, actions) for (number, name), actions in taken.items()
            )
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

    def _step(
        self, episode: Episode, name: str, entry: PolicyEntry, decide: Decide, before: tuple[str, ...]
    ) -> tuple[dict, dict]:
        """Let one policy decide and act; return its row and its seconds."""
        history = self._answers.history(entry.explainer, episode.number, before) if entry.explainer else []
        started = perf_counter()
        decision = decide(
            Case(
                actions=before,
                scores_T_C=np.array([answer.scores_C for answer in history]) if history else None,
                bald_T=np.array([answer.bald for answer in history]) if history else None,
                cause=episode.situation.cause if entry.oracle else "",
                random=generator(*self._axes, "policy", episode.number),
            )
        )
        spent = perf_counter() - started
        last = history[-1] if history else Answer(np.full(len(CONCEPTS), np.nan), np.nan, 0.0)
        old, new, action_seconds = episode.outcomes[before], None, 0.0
        if decision.action != QUEUE:
            new = episode.take((*before, decision.action), self._actions, self._settings)
            action_seconds = new.seconds
        shelf, model = episode.situation.shelf, episode.situation.model
        row = {
            "episode": episode.number,
            "cause": episode.situation.cause,
            "object": shelf.objects.names[model],
            "symmetric": shelf.symmetric[model],
            "tries": episode.tries,
            "policy": name,
            "action": decision.action,
            "concept": decision.concept,
            **{f"score_{concept}": score for concept, score in zip(CONCEPTS, last.scores_C, strict=True)},
            "bald": last.bald,
            "error_before": old.error,
            "error_after": (new or old).error,
            "recovered": bool(new is not None and new.error <= CORRECT),
        }
        return row, {"explanation_seconds": spent + last.seconds, "action_seconds": action_seconds}
