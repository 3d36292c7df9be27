"""The explainers that policies read. They learn from other scenes, and see each registration once, in batches."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from gpca.classifier.scores import Attribution
from gpca.encoders.training import embed, train_encoder
from gpca.explainers.interface import ConceptExplainer, answer_of
from gpca.explainers.registry import explainer_entry
from gpca.pairs.dataset import Registrations
from gpca.pairs.synthesis import as_registrations
from gpca.recovery.episodes import Episode
from gpca.recovery.settings import RecoverySettings
from gpca.uncertainty.designs import evaluate_design

Explain = Callable[[Registrations], Attribution]


CaseKey = tuple[str, int, tuple[str, ...]]  # an explainer, an episode, and the actions after which it explains


class Answer(NamedTuple):
    """Scores that sum to one, their variances and BALD in nats (NaN where there are none), and the seconds it took."""

    scores_C: np.ndarray
    variances_C: np.ndarray
    bald: float
    seconds: float


@dataclass
class Answers:
    """The answers so far, of episodes that stand at the place of their number, by explainers that the policies read."""

    episodes: Sequence[Episode]
    explain: Mapping[str, Explain]
    actions: Sequence[str]  # the names of all
    budget: int
    _answers: dict[CaseKey, Answer] = field(default_factory=dict)

    def ask(self, wanted: Iterable[CaseKey]) -> None:
        """Explain the registrations that no explainer of that name has seen yet, in a fixed order."""
        wanted = set(wanted) - set(self._answers)
        for explainer, explain in self.explain.items():
            new = sorted(key for key in wanted if key[0] == explainer)
            if not new:
                continue
            records = [record_of(self.episodes[e], taken, self.actions, self.budget) for _, e, taken in new]
            attribution = explain(as_registrations(records)[0].without_labels())
            self._answers |= dict(zip(new, answers_of(attribution), strict=True))

    def history(self, explainer: str, episode: int, actions: tuple[str, ...]) -> list[Answer]:
        """An explainer's answers at the start and after each of these actions."""
        return [self._answers[explainer, episode, actions[:n]] for n in range(len(actions) + 1)]


def record_of(episode: Episode, taken: tuple[str, ...], actions: Sequence[str], budget: int) -> dict:
    """A registration's row; its sample number, which names random numbers, tells episode and actions taken."""
    base = len(actions) + 1
    code = sum((1 + list(actions).index(action)) * base**place for place, action in enumerate(taken))
    return episode.outcomes[taken].record | {"sample": base**budget * episode.number + code, "split": "test"}


def starts_of(episodes: Sequence[Episode], actions: Sequence[str], budget: int) -> Registrations:
    """The first registrations of episodes, with their causes, numbered as the policies' explainers see them."""
    return as_registrations([record_of(episode, (), actions, budget) for episode in episodes])[0]


def answers_of(attribution: Attribution) -> list[Answer]:
    scores_N_C = as_shares(attribution.scores_N_C)
    bald_N, seconds_N = attribution.bald_N.tolist(), attribution.seconds_N.tolist()
    return list(map(Answer, scores_N_C, attribution.variances_N_C, bald_N, seconds_N))


def as_shares(scores_N_C: np.ndarray) -> np.ndarray:
    """Scores that sum to one: as they are where they do, by softmax of signed ones, e.g. Shapley values."""
    from scipy.special import softmax

    shares = (scores_N_C >= 0).all() and np.allclose(scores_N_C.sum(axis=1), 1)
    return scores_N_C if shares else softmax(scores_N_C, axis=1)


def learn_explainers(
    names: Iterable[str], registrations: Registrations, settings: RecoverySettings, source: str, seed: int
) -> dict[str, Explain]:
    """Train the encoder and fit every explainer on the split ``train``; return what attributes registrations."""
    train = registrations.subset(registrations.rows("train"))

    @cache
    def model() -> Any:
        return train_encoder(registrations, source, seed, settings.encoder)[0]

    def embedded(given: Registrations) -> Registrations:
        h_S_d, logits_S_C = embed(model(), given, source, seed, settings.encoder)
        return replace(given, attached={"embedding": h_S_d, "head_logits": logits_S_C})

    def remedied(given: Registrations) -> Registrations:
        outcomes, *seconds = evaluate_design("removal", given, source, seed, settings.uncertainty)
        return outcomes.attach_to(given, *seconds)

    def timed(explainer: ConceptExplainer, attach: Callable, given: Registrations) -> Attribution:
        started = perf_counter()
        attribution = answer_of(explainer, attach(given))
        # All get the same, as the encoder sees many at once; the explainer's own seconds hold what remedies took too.
        return replace(attribution, seconds_N=np.full(len(given), (perf_counter() - started) / len(given)))

    few = train.subset(np.arange(len(train))[: settings.section["remedied"]])
    explain: dict[str, Explain] = {}
    for name in names:
        entry = explainer_entry(name)
        explainer = entry.made(source, seed, **(settings.explainers.get(name) or {}))
        reads_embeddings = entry.reads == "embeddings"
        attach = embedded if reads_embeddings else remedied
        explainer.fit(attach(train if reads_embeddings else few))
        explain[name] = partial(timed, explainer, attach)
    return explain
