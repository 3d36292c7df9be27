"""The encoder's own softmax head, which GP-CA drops: what the Gaussian process adds is measured against it."""

from __future__ import annotations

import numpy as np

from gpca.explainers.interface import ExplainerEntry, ScoringExplainer, attached
from gpca.pairs.dataset import Registrations


class SoftmaxHead(ScoringExplainer):
    """Scores are the softmax of the head's logits, averaged over the draws from a cloud as the embedding is.

    Attributes:
        trained_with_encoder: labels that are given to ``fit`` teach it nothing.
    """

    trained_with_encoder = True

    def __init__(self, source: str, seed: int) -> None:
        pass

    def fit(self, registrations: Registrations) -> None:
        """Do nothing: the head was trained with the encoder, on the same training rows."""

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the softmax of the logits."""
        from scipy.special import softmax

        return softmax(attached(registrations, "head_logits"), axis=1)


EXPLAINERS = {"softmax_head": ExplainerEntry("Softmax head", SoftmaxHead, ("source",), reads="embeddings")}
