"""Gaussian Process Concept Attribution, the paper's method, as an explainer."""

import numpy as np

from gpca.classifier.settings import GPCArguments
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer
from gpca.pairs.dataset import Registrations


class GPCA(ScoringExplainer):
    """Gaussian Process Concept Attribution (the paper): a GPC on the embeddings of the ICP-aligned clouds."""

    def __init__(self, source: str, seed: int, **settings: GPCArguments) -> None:
        # Imported here, because the workflow imports this file only for its entries.
        from gpca.classifier.gpc import GPC, GPCSettings

        self._gpc = GPC(self.labels, GPCSettings(**settings), source, seed)

    def fit(self, registrations: Registrations) -> None:
        self._gpc.fit(self._inputs(registrations), registrations.concept)

    def learn(self, registrations: Registrations) -> None:
        self._gpc.update(self._inputs(registrations), registrations.concept)

    def summary(self, registrations: Registrations) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self._gpc.attribute(self._inputs(registrations))

    def _inputs(self, registrations: Registrations) -> np.ndarray:
        return registrations.embedding


class DescriptorGPCA(GPCA):
    """GP-CA on descriptors, normalized by their ranks among the training samples; `axes` name the random numbers."""

    def __init__(self, axes: tuple, source: str, seed: int, **settings: GPCArguments) -> None:
        from gpca.explainers.pair_classifier import NormalizedFeatures

        super().__init__(source, seed, **settings)
        self._normalized = NormalizedFeatures(*axes)

    def fit(self, registrations: Registrations) -> None:
        features_N_F = self.features(registrations)
        self._normalized.fit(features_N_F)
        self._gpc.fit(self._normalized(features_N_F), registrations.concept)

    def features(self, registrations: Registrations) -> np.ndarray:
        raise NotImplementedError

    def _inputs(self, registrations: Registrations) -> np.ndarray:
        return self._normalized(self.features(registrations))


EXPLAINERS = {
    "gpca_paper": ExplainerEntry("GP-CA (paper's setting)", GPCA, ("source",), reads="embeddings"),
    "gpca": ExplainerEntry("GP-CA (trained longer)", GPCA, ("source",), reads="embeddings"),
    "gpca_matern": ExplainerEntry("GP-CA (Matérn row of Table IV)", GPCA, ("source",), reads="embeddings"),
}
GPCA_FORMS = ("gpca_paper", "gpca")  # the rows of Tables I and II
