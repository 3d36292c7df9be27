"""The explainers that policies read. They learn from other scenes, and see each registration once, in batches."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from gpca.attribution.scores import Attribution
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, train_encoder
from gpca.explainers.registry import explainer_entry
from gpca.pairs.dataset import Registrations
from gpca.pairs.synthesis import as_registrations
from gpca.recovery.episodes import Episode
from gpca.uncertainty.designs import evaluate_design
from gpca.uncertainty.settings import UncertaintySettings

Explain = Callable[[Registrations], Attribution]
Attach = Callable[[Registrations], Registrations]


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
        """An explainer's answers at the start and after each of these actions."""
        return [self._answers[CaseKey(explainer, episode, actions[:n])] for n in range(len(actions) + 1)]


def record_of(episode: Episode, taken: tuple[str, ...], actions: Sequence[str], budget: int) -> dict:
    """A registration's row; its sample number, which names random numbers, tells episode and actions taken.

    Args:
        actions: the names of all.
        budget: how many of them an episode may take.
    """
    base = len(actions) + 1
    code = sum((1 + list(actions).index(action)) * base**place for place, action in enumerate(taken))
    return episode.outcomes[taken].record | {"sample": base**budget * episode.number + code, "split": "test"}


def starts_of(episodes: Sequence[Episode], actions: Sequence[str], budget: int) -> Registrations:
    """The first registrations of episodes, with their causes, numbered as the policies' explainers see them."""
    return as_registrations([record_of(episode, (), actions, budget) for episode in episodes])[0]


def answers_of(attribution: Attribution) -> list[Answer]:
    """An attribution's rows as answers."""
    scores_N_C = as_shares(attribution.scores_N_C)
    rows = zip(scores_N_C, attribution.variances_N_C, attribution.bald_N, attribution.seconds_N, strict=True)
    return [Answer(scores_C, variances_C, float(bald), float(time)) for scores_C, variances_C, bald, time in rows]


def as_shares(scores_N_C: np.ndarray) -> np.ndarray:
    """Scores that sum to one: as they are where they do, by softmax of signed ones, e.g. Shapley values."""
    from scipy.special import softmax

    shares = (scores_N_C >= 0).all() and np.allclose(scores_N_C.sum(axis=1), 1)
    return scores_N_C if shares else softmax(scores_N_C, axis=1)


@dataclass(frozen=True)
class LoopExplainers:
    """Explainers by name, and how well each does on the calibration samples.

    Attributes:
        explain: for each name the function that attributes registrations without labels.
        fitted: for each name the explainer itself.
        attach: for each name the function that adds to registrations what the explainer reads.
        calibration: for each name its predictions for the calibration samples.
        concepts: (N,) the truth about those.
    """

    explain: Mapping[str, Explain]
    fitted: Mapping[str, Any]
    attach: Mapping[str, Attach]
    calibration: Mapping[str, Attribution]
    concepts: np.ndarray

    def right(self, name: str) -> np.ndarray:
        """Which calibration samples (N,) an explainer attributes rightly."""
        return self.calibration[name].predicted_N == self.concepts


def learn_explainers(
    names: Iterable[str],
    registrations: Registrations,
    encoder: EncoderSettings,
    settings: Mapping[str, Mapping],
    uncertainty: UncertaintySettings,
    most_remedied: int,
    source: str,
    seed: int,
) -> LoopExplainers:
    """Train the encoder and fit every explainer on the split ``train``; the other split is for calibration.

    Args:
        names: explainers (:mod:`gpca.explainers.registry`) that read embeddings or the design ``removal``.
        settings: explainer -> its settings.
        most_remedied: training samples whose remedies are run, at most; Monte-Carlo ICP is slow.
    """
    train, held_out = (registrations.subset(registrations.rows(split)) for split in ("train", "test"))
    fitted, attached = {}, {}
    model = None
    for name in names:
        entry = explainer_entry(name)
        explainer = entry.make(source, seed, **(settings.get(name) or {}))
        if entry.reads == "embeddings":
            model = model or train_encoder(registrations, source, seed, encoder)[0]
            attach = _embedding(model, source, seed, encoder)
            learned = train
        else:
            attach = _remedies(source, seed, uncertainty)
            learned = train.subset(np.arange(len(train))[:most_remedied])
        explainer.fit(attach(learned))
        fitted[name], attached[name] = explainer, attach
    explain = {name: _timed(explainer, attached[name]) for name, explainer in fitted.items()}
    calibration = {name: of_name(held_out.without_labels()) for name, of_name in explain.items()}
    return LoopExplainers(explain, fitted, attached, calibration, held_out.concept)


def _timed(explainer, attach) -> Explain:
    def explain(registrations: Registrations) -> Attribution:
        started = perf_counter()
        attached = attach(registrations)
        attribution = explainer.explain(attached)
        # All get the same, as the encoder sees many at once; the explainer's own seconds hold what remedies took too.
        each = (perf_counter() - started) / len(registrations)
        return replace(attribution, seconds_N=np.full(len(registrations), each))

    return explain


def _embedding(model, source: str, seed: int, settings: EncoderSettings):
    def attach(registrations: Registrations) -> Registrations:
        h_S_d, logits_S_C = embed(model, registrations, source, seed, settings)
        return replace(registrations, attached={"embedding": h_S_d, "head_logits": logits_S_C})

    return attach


def _remedies(source: str, seed: int, settings: UncertaintySettings):
    def attach(registrations: Registrations) -> Registrations:
        outcomes, *seconds = evaluate_design("removal", registrations, source, seed, settings)
        return outcomes.attach_to(registrations, *seconds)

    return attach
