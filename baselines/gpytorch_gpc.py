"""GP-CA in gpytorch's own classes: the paper's classifier as gpytorch's tutorials write it, beside the suite's form.

It is no rival but a check: from the same start and random numbers it gives what ``gpca_paper`` gives but for rounding.
"""

from __future__ import annotations

import numpy as np

from gpca.classifier.settings import GPCArguments
from gpca.explainers.interface import DrawingExplainer, ExplainerEntry
from gpca.pairs.dataset import Registrations


class GpytorchGPCA(DrawingExplainer):
    """GP-CA on the embeddings of the aligned clouds, by :class:`gpca.classifier.gpytorch_classes.GpytorchGPC`."""

    def __init__(self, source: str, seed: int, **settings: GPCArguments) -> None:
        from gpca.classifier.gpytorch_classes import GpytorchGPC
        from gpca.classifier.settings import GPCSettings

        self._gpc = GpytorchGPC(self.labels, GPCSettings(**settings), source, seed)

    def fit(self, registrations: Registrations) -> None:
        """Fit to the labeled embeddings; as many of them as concepts raise an InputError."""
        self._gpc.fit(registrations.embedding, registrations.concept)

    def summary(self, registrations: Registrations) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Summarize draws from the posterior at every embedding, as GP-CA does."""
        return self._gpc.attribute(registrations.embedding)


EXPLAINERS = {
    "gpca_gpytorch": ExplainerEntry("GP-CA (gpytorch's classes)", GpytorchGPCA, ("source",), reads="embeddings")
}
