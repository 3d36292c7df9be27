"""Gaussian Process Concept Attribution, the paper's method, as an explainer."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from gpca.attribution.scores import Attribution
from gpca.explainers.interface import ExplainerEntry
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS


class GPCA:
    """Gaussian Process Concept Attribution (the paper): a GPC on the embeddings of the ICP-aligned clouds.

    Attributes:
        labels: what it names.
    """

    labels: tuple[str, ...] = CONCEPTS

    def __init__(self, source: str, seed: int, **settings) -> None:
        from gpca.classifier.gpc import (  # here, because the workflow imports this file only to know its entries
            GPC,
            GPCSettings,
        )

        self._gpc = GPC(self.labels, GPCSettings(**settings), source, seed)

    def fit(self, registrations: Registrations) -> None:
        """Fit the GPC to the labelled embeddings."""
        self._gpc.fit(self._inputs(registrations), registrations.concept)

    def learn(self, registrations: Registrations) -> None:
        """Learn further labels, see :meth:`gpca.classifier.gpc.GPC.update`."""
        self._gpc.update(self._inputs(registrations), registrations.concept)

    def explain(self, registrations: Registrations) -> Attribution:
        """Draw from the posterior at every embedding and summarise (Eqs. 4 to 7)."""
        started = perf_counter()
        scores_N_C, variances_N_C, bald_N = self._gpc.attribute(self._inputs(registrations))
        seconds = (perf_counter() - started) / len(registrations)
        zeros_N = np.zeros(len(registrations))
        return Attribution(
            concepts=self.labels,
            scores_N_C=scores_N_C,
            variances_N_C=variances_N_C,
            bald_N=bald_N,
            abstained_N=zeros_N.astype(bool),
            icp_calls_N=zeros_N.astype(int),
            seconds_N=zeros_N + seconds,
            icp_seconds_N=zeros_N,
        )

    def _inputs(self, registrations: Registrations) -> np.ndarray:
        return registrations.embedding


EXPLAINERS = {
    "gpca_paper": ExplainerEntry("GP-CA (paper's setting)", GPCA, reads="embeddings"),
    "gpca": ExplainerEntry("GP-CA (trained longer)", GPCA, reads="embeddings"),
}
GPCA_FORMS = tuple(EXPLAINERS)
