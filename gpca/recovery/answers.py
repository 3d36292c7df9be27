"""What explainers answered about episodes: each sees a registration once, together with all others that are new."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gpca.attribution.scores import Attribution
from gpca.pairs.dataset import Registrations
from gpca.pairs.synthesis import as_registrations
from gpca.recovery.episodes import Episode

Explain = Callable[[Registrations], Attribution]


class CaseKey(NamedTuple):
    """What an explainer is asked about: an episode after these actions."""

    explainer: str
    episode: int
    actions: tuple[str, ...]


class Answer(NamedTuple):
    """Scores that sum to one, BALD in nats, and the seconds that it took."""

    scores_C: np.ndarray
    bald: float
    seconds: float


class Answers:
    """The answers so far.

    Args:
        episodes: each stands at the place of its number.
        explain: for each explainer that the policies read, the function that attributes registrations.
        actions: the names of all.
        budget: how many actions an episode may take.
    """

    def __init__(
        self, episodes: Sequence[Episode], explain: Mapping[str, Explain], actions: Sequence[str], budget: int
    ) -> None:
        self._episodes = episodes
        self._explain = explain
        self._actions = list(actions)
        self._budget = budget
        self._answers: dict[CaseKey, Answer] = {}

    def ask(self, wanted: Iterable[CaseKey]) -> None:
        """Explain the registrations that no explainer of that name has seen yet, in a fixed order."""
        wanted = set(wanted) - set(self._answers)
        for explainer, explain in self._explain.items():
            new = sorted(key for key in wanted if key.explainer == explainer)
            if not new:
                continue
            said = explain(as_registrations([self._record(key) for key in new])[0].without_labels())
            scores_N_C = as_shares(said.scores_N_C)
            for n, key in enumerate(new):
                self._answers[key] = Answer(scores_N_C[n], float(said.bald_N[n]), float(said.seconds_N[n]))

    def history(self, explainer: str, episode: int, actions: tuple[str, ...]) -> list[Answer]:
        """Return what an explainer said at the start and after each of these actions."""
        return [self._answers[CaseKey(explainer, episode, actions[:n])] for n in range(len(actions) + 1)]

    def _record(self, key: CaseKey) -> dict:
        """Return the registration's row; its sample number, which names random numbers, tells episode and actions."""
        base = len(self._actions) + 1
        code = sum((1 + self._actions.index(action)) * base**place for place, action in enumerate(key.actions))
        record = self._episodes[key.episode].outcomes[key.actions].record
        return record | {"sample": base**self._budget * key.episode + code, "split": "test"}


def as_shares(scores_N_C: np.ndarray) -> np.ndarray:
    """Return scores that sum to one: as they are where they do, by softmax of signed ones, e.g. Shapley values."""
    from scipy.special import softmax

    shares = (scores_N_C >= 0).all() and np.allclose(scores_N_C.sum(axis=1), 1)
    return scores_N_C if shares else softmax(scores_N_C, axis=1)
