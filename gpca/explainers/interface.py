"""The interface of every explainer; :mod:`baselines.registry` finds them by name.

An explainer is a class with ``fit`` and ``explain`` in a file of ``baselines/``, listed in that file's
``EXPLAINERS`` by the name under which the config switches it on::

    EXPLAINERS = {"my_explainer": ExplainerEntry("My explainer", MyExplainer)}
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from gpca.attribution.scores import Attribution
from gpca.pairs.dataset import Registrations


class ConceptExplainer(Protocol):
    """What the workflow calls; made as ``make(source, seed, **settings)``."""

    def fit(self, registrations: Registrations) -> None:
        """Learn from labelled registrations (the rows of split ``train``)."""

    def explain(self, registrations: Registrations) -> Attribution:
        """Attribute every registration. What was perturbed is hidden from it, unless it is an oracle."""


@dataclass(frozen=True)
class ExplainerEntry:
    """An explainer by name.

    Attributes:
        title: what tables call it.
        make: what makes it from source, seed and the settings of the config.
        reads: what it needs attached: ``embeddings`` those of the encoder, ``uncertainty/<design>`` the outcomes of
            that design (:mod:`gpca.uncertainty.designs`); ``registrations`` nothing.
        oracle: whether it is told the truth about what it explains: an upper bound, which its title has to say.
    """

    title: str
    make: Callable[..., ConceptExplainer]
    reads: str = "registrations"
    oracle: bool = False

    @property
    def design(self) -> str | None:
        """The design whose outcomes it reads, if any."""
        return self.reads.removeprefix("uncertainty/") if self.reads.startswith("uncertainty/") else None
