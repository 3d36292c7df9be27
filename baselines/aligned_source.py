"""GP-CA by other code and for causes, and its rivals that read the embedding of the aligned source alone."""

from functools import partial

import numpy as np

from gpca.classifier.settings import GPCArguments
from gpca.errors import InputError
from gpca.explainers.classifiers import known_concepts
from gpca.explainers.gpca import GPCA
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer, attached, for_causes
from gpca.pairs.dataset import Registrations
from gpca.settings import Positive


class ConceptVectors(ScoringExplainer):
    """Concept activation vectors (CAV; Kim et al. 2018, TCAV), read per sample.

    A CAV is the normal of a linear probe between one concept and the others in the standardized embedding. The scores
    are the softmax over concepts of the projections on the CAVs, standardized on the training rows; a concept without
    training rows has score 0.
    """

    def __init__(self, source: str, seed: int, inverse_regularisation: Positive = 1.0) -> None:
        self._inverse_regularization = inverse_regularisation

    def fit(self, registrations: Registrations) -> None:
        from sklearn.linear_model import LogisticRegression
        from sklearn.preprocessing import StandardScaler

        embedding_N_d = attached(registrations, "embedding")
        self._present = known_concepts(registrations.concept, self.labels)
        if (embedding_N_d == embedding_N_d[0]).all():
            raise InputError("array 'embedding'", "is the same for all training registrations", "train the encoder")
        self._embedding_scaler = StandardScaler().fit(embedding_N_d)
        scaled_N_d = self._embedding_scaler.transform(embedding_N_d)
        probe = LogisticRegression(C=self._inverse_regularization, max_iter=1000)
        normals = [probe.fit(scaled_N_d, registrations.concept == concept).coef_[0] for concept in self._present]
        self.vectors_K_d = np.array([normal / np.linalg.norm(normal) for normal in normals])
        self._projection_scaler = StandardScaler().fit(scaled_N_d @ self.vectors_K_d.T)

    def scores(self, registrations: Registrations) -> np.ndarray:
        from scipy.special import softmax

        scaled_N_d = self._embedding_scaler.transform(attached(registrations, "embedding"))
        positions_N_C = np.full((len(registrations), len(self.labels)), -np.inf)
        columns = [self.labels.index(concept) for concept in self._present]
        positions_N_C[:, columns] = self._projection_scaler.transform(scaled_N_d @ self.vectors_K_d.T)
        return softmax(positions_N_C, axis=1)


class SoftmaxHead(ScoringExplainer):
    """The encoder's own head, which GP-CA drops: softmax of its logits, averaged over the draws from a cloud."""

    trained_with_encoder = True

    def scores(self, registrations: Registrations) -> np.ndarray:
        from scipy.special import softmax

        return softmax(attached(registrations, "head_logits"), axis=1)


class GpytorchGPCA(GPCA):
    """GP-CA in gpytorch's own classes, a check: it agrees with ``gpca_paper`` within rounding."""

    def __init__(self, source: str, seed: int, **settings: GPCArguments) -> None:
        from gpca.classifier.gpytorch_classes import GpytorchGPC
        from gpca.classifier.settings import GPCSettings

        self._gpc = GpytorchGPC(self.labels, GPCSettings(**settings), source, seed)


_entry = partial(ExplainerEntry, sees=("source",), reads="embeddings")
EXPLAINERS = {
    "gpca_gpytorch": _entry("GP-CA (gpytorch's classes)", GpytorchGPCA),
    "concept_vectors": _entry("Concept activation vectors", ConceptVectors),
    "softmax_head": _entry("Softmax head", SoftmaxHead),
}
CAUSE_EXPLAINERS = {
    "gpca": _entry("GP-CA (aligned source)", for_causes(GPCA)),
    "softmax_head": _entry("Softmax head (aligned source)", for_causes(SoftmaxHead)),
    "concept_vectors": _entry("Concept activation vectors", for_causes(ConceptVectors)),
}
