"""Concept activation vectors (Kim et al. 2018, TCAV), read per sample.

TCAV's score tells how often a whole dataset moves along a concept; it says nothing of one sample. Its basis
does: the concept activation vector (CAV), the normal of a linear probe that parts one concept from the others
(TCAV's relative CAV) in the encoder's embedding. A sample is scored by how far it lies along each.
"""

from __future__ import annotations

import numpy as np

from gpca.errors import InputError
from gpca.explainers.concept_classifier import known_concepts
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer, attached
from gpca.pairs.dataset import Registrations
from gpca.settings import Positive


class ConceptVectors(ScoringExplainer):
    """One-vs-rest logistic probes; scores are the softmax over concepts of the standardized projections.

    The embedding is standardized on the training rows. A projection on a unit CAV is the signed distance from the
    probe's plane up to a constant; it is standardized on the training rows too, so that the concepts compare. The
    softmax changes no order; it gives a concept without training rows, which has no CAV, the score 0.

    Args:
        source, seed: not used; the probes are a convex problem and nothing is drawn.
        inverse_regularisation: scikit-learn's C, of the L2 penalty of the probes.
    """

    def __init__(self, source: str, seed: int, inverse_regularisation: Positive = 1.0) -> None:
        self._inverse_regularization = inverse_regularisation

    def fit(self, registrations: Registrations) -> None:
        """Fit one probe for each concept among the labels.

        Raises:
            InputError: fewer than two concepts, or an embedding that is the same for all registrations.
        """
        from sklearn.linear_model import LogisticRegression
        from sklearn.preprocessing import StandardScaler

        embedding_N_d = attached(registrations, "embedding")
        self._known = known_concepts(registrations.concept, self.labels)
        if (embedding_N_d == embedding_N_d[0]).all():
            raise InputError("array 'embedding'", "is the same for all training registrations", "train the encoder")
        self._embedding_scaler = StandardScaler().fit(embedding_N_d)
        scaled_N_d = self._embedding_scaler.transform(embedding_N_d)
        probe = LogisticRegression(C=self._inverse_regularization, max_iter=1000)
        normals = [probe.fit(scaled_N_d, registrations.concept == concept).coef_[0] for concept in self._known]
        self.vectors_K_d = np.array([normal / np.linalg.norm(normal) for normal in normals])
        self._projection_scaler = StandardScaler().fit(scaled_N_d @ self.vectors_K_d.T)

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Score every registration by its position along the CAVs."""
        from scipy.special import softmax

        scaled_N_d = self._embedding_scaler.transform(attached(registrations, "embedding"))
        positions_N_C = np.full((len(registrations), len(self.labels)), -np.inf)
        columns = [self.labels.index(concept) for concept in self._known]
        positions_N_C[:, columns] = self._projection_scaler.transform(scaled_N_d @ self.vectors_K_d.T)
        return softmax(positions_N_C, axis=1)


EXPLAINERS = {
    "concept_vectors": ExplainerEntry("Concept activation vectors", ConceptVectors, ("source",), reads="embeddings")
}
