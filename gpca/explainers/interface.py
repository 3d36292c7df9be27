"""The interface of every explainer; :mod:`gpca.explainers.registry` finds them by name.

An explainer is a class with ``fit`` and ``explain`` in a file of ``baselines/``, listed in that file's
``EXPLAINERS`` by the name under which the config switches it on::

    EXPLAINERS = {"my_explainer": ExplainerEntry("My explainer", MyExplainer, sees=("pair",))}
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Protocol, runtime_checkable

import numpy as np

from gpca.attribution.scores import Attribution
from gpca.errors import InputError
from gpca.explainers.sight import Sees, in_words, require_parts
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS


class ConceptExplainer(Protocol):
    """The interface that the workflow calls; an explainer is made by ``make(source, seed, **settings)``."""

    def fit(self, registrations: Registrations) -> None:
        """Learn from labeled registrations (the rows of split ``train``)."""

    def explain(self, registrations: Registrations) -> Attribution:
        """Attribute every registration. What was perturbed is hidden from it, unless it is an oracle."""


@runtime_checkable
class Describing(Protocol):
    """An explainer that measures each registration by itself before it learns, so that once is enough."""

    def describe(self, registrations: Registrations) -> Registrations:
        """Attach the measurements by :func:`measured`, so that ``fit`` and ``explain`` need not repeat them."""


@runtime_checkable
class Encoding(Protocol):
    """An explainer with an encoder of its own, learned once for all labels on its embeddings."""

    def learn_encoder(self, registrations: Registrations) -> Callable[[Registrations], Registrations]:
        """Train the encoder on labeled registrations, and return a function that attaches its embeddings.

        Where they are attached, ``fit`` and ``explain`` read them.
        """


class ScoringExplainer:
    """The base of explainers that give scores alone; it measures the time that they take.

    Attributes:
        labels: what it names.
    """

    labels: tuple[str, ...] = CONCEPTS

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration."""
        started = perf_counter()
        scores_N_C = self.scores(registrations)
        return Attribution.of_scores(self.labels, scores_N_C, seconds=(perf_counter() - started) / len(registrations))

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the scores (N, C) of the labels."""
        raise NotImplementedError


class DrawingExplainer:
    """The base of explainers that draw from a posterior: scores with variances and BALD, and the time that they take.

    Attributes:
        labels: what it names.
    """

    labels: tuple[str, ...] = CONCEPTS

    def explain(self, registrations: Registrations) -> Attribution:
        """Draw for every registration and summarize (Eqs. 4 to 7)."""
        started = perf_counter()
        scores_N_C, variances_N_C, bald_N = self.summary(registrations)
        seconds = (perf_counter() - started) / len(registrations)
        more = {"variances_N_C": variances_N_C, "bald_N": bald_N}
        return Attribution.of_scores(self.labels, scores_N_C, seconds=seconds, **more)

    def summary(self, registrations: Registrations) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return scores and variances (N, C) of the labels, and BALD (N,)."""
        raise NotImplementedError


def measured(
    registrations: Registrations, prefix: str, measure: Callable[[], Mapping[str, np.ndarray]]
) -> Registrations:
    """Return the registrations with arrays attached whose names begin with the prefix, measured unless they are there.

    The prefix has to name everything that the numbers depend on.
    """
    if any(name.startswith(prefix) for name in registrations.attached):
        return registrations
    own = {prefix + name: array for name, array in measure().items()}
    return replace(registrations, attached={**registrations.attached, **own})


def attached(registrations: Registrations, name: str) -> np.ndarray:
    """Return an array (S, …) that an earlier step made for the registrations, as float64; InputError without it."""
    if name not in registrations.attached:
        raise InputError(f"array '{name}'", "is not attached to the registrations", "see Registrations.attached")
    return np.asarray(registrations.attached[name], float)


BARE = "registrations"  # `reads` of an explainer that needs nothing attached
REENACTED = "reenactments"  # `reads` of one that needs those of each pair


@dataclass(frozen=True)
class ExplainerEntry:
    """An explainer by name.

    Attributes:
        title: what tables call it.
        make: what makes it from source, seed and the settings of the config.
        sees: all that its answer depends on, parts of :data:`gpca.explainers.sight.PARTS`; empty where it is nothing.
        reads: what it needs attached: ``embeddings`` those of the encoder, ``uncertainty/<design>`` the outcomes of
            that design (:mod:`gpca.uncertainty.designs`); ``registrations`` nothing.
        observed_only: of a design's outcomes it reads those of the observed pair alone, the first.
        oracle: whether it is told the truth about what it explains: an upper bound, which its title has to say.
    """

    title: str
    make: Callable[..., ConceptExplainer]
    sees: Sees
    reads: str = BARE
    oracle: bool = False
    observed_only: bool = False

    def __post_init__(self) -> None:
        require_parts(f"explainer '{self.title}'", self.sees)

    @property
    def sight(self) -> str:
        """What it sees, in words."""
        return in_words(self.sees)

    @property
    def design(self) -> str | None:
        """The design whose outcomes it reads, if any."""
        return self.reads.removeprefix("uncertainty/") if self.reads.startswith("uncertainty/") else None
