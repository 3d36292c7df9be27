"""The explainers' answers about episodes: each sees a registration once, together with all others that are new."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gpca.attribution.scores import Attribution
from gpca.experiments.recovery.episodes import Episode
from gpca.pairs.dataset import Registrations
from gpca.pairs.synthesis import as_registrations

Explain = Callable[[Registrations], Attribution]


class CaseKey(NamedTuple):
    """A registration to be explained: that of an episode after these actions."""

    explainer: str
    episode: int
    actions: tuple[str, ...]


class Answer(NamedTuple):
    """Scores that sum to one, their variances and BALD in nats (NaN where there are none), and the seconds it took."""

    scores_C: np.ndarray
    variances_C: np.ndarray
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
        self._actions = actions
        self._budget = budget
        self._answers: dict[CaseKey, Answer] = {}

    def ask(self, wanted: Iterable[CaseKey]) -> None:
        """Explain the registrations that no explainer of that name has seen yet, in a fixed order."""
        wanted = set(wanted) - set(self._answers)
        for explainer, explain in self._explain.items():
            new = sorted(key for key in wanted if key.explainer == explainer)
            if not new:
                continue
            records = [record_of(self._episodes[key.episode], key.actions, self._actions, self._budget) for key in new]
            attribution = explain(as_registrations(records)[0].without_labels())
            self._answers |= dict(zip(new, answers_of(attribution), strict=True))

    def history(self, explainer: str, episode: int, actions: tuple[str, ...]) -> list[Answer]:
        """Return an explainer's answers at the start and after each of these actions."""
        return [self._answers[CaseKey(explainer, episode, actions[:n])] for n in range(len(actions) + 1)]


def record_of(episode: Episode, taken: tuple[str, ...], actions: Sequence[str], budget: int) -> dict:
    """Return a registration's row; its sample number, which names random numbers, tells episode and actions taken.

    Args:
        actions: the names of all.
        budget: how many of them an episode may take.
    """
    base = len(actions) + 1
    code = sum((1 + list(actions).index(action)) * base**place for place, action in enumerate(taken))
    return episode.outcomes[taken].record | {"sample": base**budget * episode.number + code, "split": "test"}


def starts_of(episodes: Sequence[Episode], actions: Sequence[str], budget: int) -> Registrations:
    """Return the first registrations of episodes, with their causes, numbered as the policies' explainers see them."""
    return as_registrations([record_of(episode, (), actions, budget) for episode in episodes])[0]


def answers_of(attribution: Attribution) -> list[Answer]:
    """Return an attribution's rows as answers."""
    scores_N_C = as_shares(attribution.scores_N_C)
    rows = zip(scores_N_C, attribution.variances_N_C, attribution.bald_N, attribution.seconds_N, strict=True)
    return [Answer(scores_C, variances_C, float(bald), float(time)) for scores_C, variances_C, bald, time in rows]


def as_shares(scores_N_C: np.ndarray) -> np.ndarray:
    """Return scores that sum to one: as they are where they do, by softmax of signed ones, e.g. Shapley values."""
    from scipy.special import softmax

    shares = (scores_N_C >= 0).all() and np.allclose(scores_N_C.sum(axis=1), 1)
    return scores_N_C if shares else softmax(scores_N_C, axis=1)
