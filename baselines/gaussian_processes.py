"""GP-CA on the embedding of the aligned source, by other code and for other labels."""

from __future__ import annotations

import numpy as np

from gpca.causes.dataset import LABELS
from gpca.classifier.settings import GPCArguments
from gpca.explainers.gpca import GPCA
from gpca.explainers.interface import DrawingExplainer, ExplainerEntry
from gpca.pairs.dataset import Registrations


class GpytorchGPCA(DrawingExplainer):
    """GP-CA in gpytorch's own classes, a check: it agrees with ``gpca_paper`` within rounding."""

    def __init__(self, source: str, seed: int, **settings: GPCArguments) -> None:
        from gpca.classifier.gpytorch_classes import GpytorchGPC
        from gpca.classifier.settings import GPCSettings

        self._gpc = GpytorchGPC(self.labels, GPCSettings(**settings), source, seed)

    def fit(self, registrations: Registrations) -> None:
        self._gpc.fit(registrations.embedding, registrations.concept)

    def summary(self, registrations: Registrations) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self._gpc.attribute(registrations.embedding)


class CauseGPCA(GPCA):
    """GP-CA over nominal, noise, pose and overlap."""

    labels = LABELS


EXPLAINERS = {
    "gpca_gpytorch": ExplainerEntry("GP-CA (gpytorch's classes)", GpytorchGPCA, ("source",), reads="embeddings")
}
CAUSE_EXPLAINERS = {"gpca": ExplainerEntry("GP-CA (aligned source)", CauseGPCA, ("source",), reads="embeddings")}
