"""The interface of explainers, which :mod:`gpca.explainers.registry` finds by name (docs/adding.md)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any, Literal, Protocol, get_args, runtime_checkable

import numpy as np

from gpca.classifier.scores import Attribution
from gpca.errors import InputError
from gpca.explainers.classifiers import known_concepts, scores_of
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS

if TYPE_CHECKING:
    from gpca.causes.settings import DescriptorSettings

Part = Literal["source", "pair", "motion", "runs", "quick_remedies", "remedies", "reenactment", "truth"]
PARTS: tuple[str, ...] = get_args(Part)
Sees = tuple[Part, ...]  # all parts of a registration that an explainer's answer depends on
WORDS = {  # in tables
    "source": "aligned source",  # where ICP put it
    "pair": "pair",  # both clouds after ICP, and what follows from them: numbers of points, ICP's fitness and RMSE
    "motion": "motion",  # of ICP: how far it moved the cloud
    "runs": "further runs",  # of the same registration, from other starts or with knobs turned
    "quick_remedies": "remedies",  # those without restarts
    "remedies": "remedies",  # the registration again, with each combination of them
    "reenactment": "re-enactment",  # the registration again under hypotheses of the true pose
    "truth": "truth",
}
NOTHING = "nothing"
BARE = "registrations"  # `reads` of an explainer that needs nothing attached
REENACTED = "reenactments"  # `reads` of an explainer that needs the re-enactments of each pair
EMBEDDINGS = "embeddings"  # of trained encoders
READS = (BARE, "descriptors", REENACTED, EMBEDDINGS)


class ConceptExplainer(Protocol):
    """The interface that the workflow calls; an explainer is made by ``make(source, seed, **settings)``."""

    def fit(self, registrations: Registrations) -> None:
        """Learn from labeled registrations (the rows of split ``train``)."""

    def explain(self, registrations: Registrations) -> Attribution:
        """Attribute every registration. The perturbation is hidden from all explainers but oracles."""


@runtime_checkable
class Describing(Protocol):
    """An explainer whose measurements of a registration do not depend on training."""

    def describe(self, registrations: Registrations) -> Registrations:
        """Attach the measurements by :func:`measured`, so that ``fit`` and ``explain`` need not repeat them."""


@runtime_checkable
class Encoding(Protocol):
    """An explainer that trains an encoder, once for several sets of labels."""

    def learn_encoder(self, registrations: Registrations) -> Callable[[Registrations], Registrations]:
        """Train the encoder on labeled registrations; return a function that attaches its embeddings."""


def answer_of(
    explainer: ConceptExplainer, registrations: Registrations, labels: tuple[str, ...] = CONCEPTS
) -> Attribution:
    """Return what an explainer answers, with its columns in the order of the labels; InputError for what cannot be."""
    subject, count = f"explainer {type(explainer).__name__}", len(registrations)
    try:
        answer = explainer.explain(registrations)
    except InputError as refused:
        raise InputError(subject, str(refused)) from refused
    if not isinstance(answer, Attribution):
        raise InputError(subject, f"answers with a {type(answer).__name__}", "make it by Attribution.of_scores")
    if len(answer.scores_N_C) != count:
        fault = f"answers for {len(answer.scores_N_C)} registrations, and is asked about {count}"
        raise InputError(subject, fault, "give one row of scores for each, in their order")
    if set(answer.concepts) != set(labels):
        raise InputError(subject, f"scores {', '.join(answer.concepts)}", f"score {', '.join(labels)}")
    return answer if answer.concepts == labels else answer.in_order(labels)


class ScoringExplainer:
    """Base of explainers that give scores for their `labels`; it measures the time."""

    labels: tuple[str, ...] = CONCEPTS

    def __init__(self, source: str, seed: int) -> None:
        """Ignore source and seed; explainers with random numbers or settings override this."""

    def fit(self, registrations: Registrations) -> None:
        """Learn nothing; explainers that learn override this."""

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration."""
        started = perf_counter()
        scores_N_C, variances_N_C, bald_N = self.summary(registrations)
        seconds = (perf_counter() - started) / len(registrations)
        return Attribution.of_scores(
            self.labels, scores_N_C, seconds=seconds, variances_N_C=variances_N_C, bald_N=bald_N
        )

    def summary(self, registrations: Registrations) -> tuple[np.ndarray, np.ndarray | None, np.ndarray | None]:
        """Return scores and, if any, variances (N, C), and BALD (N,)."""
        return self.scores(registrations), None, None

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the scores (N, C)."""
        raise NotImplementedError


def for_causes(explainer: type) -> type:
    from gpca.causes.dataset import LABELS

    return type(f"Cause{explainer.__name__}", (explainer,), {"labels": LABELS})


class ClassifierExplainer(ScoringExplainer):
    """Scores are the probabilities of an initially unfitted scikit-learn classifier on some features."""

    def __init__(self, classifier) -> None:
        self._classifier = classifier

    def fit(self, registrations: Registrations) -> None:
        known_concepts(registrations.concept, self.labels)
        self._classifier.fit(self.features(registrations), registrations.concept)

    def scores(self, registrations: Registrations) -> np.ndarray:
        return scores_of(self._classifier, self.features(registrations), self.labels)

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the classifier's features (N, F)."""
        raise NotImplementedError


def measured(
    registrations: Registrations, prefix: str, measure: Callable[[], Mapping[str, np.ndarray]]
) -> Registrations:
    """Attach arrays under a prefix that names all that they depend on, unless some are attached already."""
    if any(name.startswith(prefix) for name in registrations.attached):
        return registrations
    arrays = {prefix + name: array for name, array in measure().items()}
    return replace(registrations, attached={**registrations.attached, **arrays})


def attached(registrations: Registrations, name: str) -> np.ndarray:
    if name not in registrations.attached:
        raise InputError(f"array '{name}'", "is not attached to the registrations", "see Registrations.attached")
    return np.asarray(registrations.attached[name], float)


@dataclass(frozen=True)
class ExplainerEntry:
    """An explainer by name."""

    title: str  # its name in tables
    make: Callable[..., ConceptExplainer]  # makes it from source, seed and the settings of the config
    sees: Sees  # all that its answer depends on, of :data:`PARTS`; may be empty
    # What it needs attached: ``embeddings`` of the encoder, ``uncertainty/<design>`` outcomes of a design
    # (:mod:`gpca.uncertainty.designs`), or ``registrations``: nothing.
    reads: str = BARE
    oracle: bool = False  # whether it knows the truth about what it explains: a bound, which its title has to say
    observed_only: bool = False  # of a design's outcomes it reads the first alone, that of the observed pair
    further: bool = False  # whether it learns from further samples too, which have quick descriptors alone

    def __post_init__(self) -> None:
        if not isinstance(self.sees, tuple) or not set(self.sees) <= set(PARTS):
            remedy = f"give a tuple of {', '.join(PARTS)}, or () for {NOTHING}"
            raise InputError(f"explainer '{self.title}'", f"sees {self.sees!r}", remedy)
        if self.reads not in READS and self.design is None:
            raise InputError(f"explainer '{self.title}'", f"reads {self.reads!r}", f"give one of {', '.join(READS)}")

    def made(self, *axes: object, **settings: Any) -> ConceptExplainer:
        """Return a new explainer; InputError for what an entry from outside makes instead."""
        explainer = self.make(*axes, **settings)
        if not all(callable(getattr(explainer, name, None)) for name in ("fit", "explain")):
            fault = f"is a {type(explainer).__name__} without fit or explain"
            raise InputError(f"explainer '{self.title}'", fault, "make it as docs/adding.md says")
        return explainer

    @property
    def sight(self) -> str:
        return in_words(self.sees)

    @property
    def design(self) -> str | None:
        """The design whose outcomes it reads, if any."""
        return self.reads.removeprefix("uncertainty/") if self.reads.startswith("uncertainty/") else None


def in_words(sees: Collection[str]) -> str:
    return " + ".join(WORDS[part] for part in PARTS if part in sees) or NOTHING


def icp_calls(sees: Collection[str], starts: int, descriptors: DescriptorSettings, reenactment: int = 0) -> int:
    """Return the number of ICP runs that an explainer of causes needs beyond the explained one."""
    further = (starts - 1) * ("runs" in sees) + reenactment * ("reenactment" in sees)
    if "remedies" in sees:
        return further + descriptors.remedy_calls
    return further + descriptors.quick_remedy_calls * ("quick_remedies" in sees)
