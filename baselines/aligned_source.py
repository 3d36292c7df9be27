"""Explainers of causes that read the embedding of the aligned source alone, as the paper lets GP-CA do.

They are those of concepts, with the class "nominal" beside these.
"""

from __future__ import annotations

from baselines.concept_vectors import ConceptVectors
from baselines.softmax_head import SoftmaxHead
from gpca.causes.dataset import LABELS
from gpca.explainers.gpca import GPCA
from gpca.explainers.interface import ExplainerEntry


class CauseGPCA(GPCA):
    """GP-CA over nominal, noise, pose and overlap."""

    labels = LABELS


class CauseVectors(ConceptVectors):
    """A concept activation vector for each label against the others."""

    labels = LABELS


class CauseHead(SoftmaxHead):
    """The encoder's own head, trained with it on the same labels."""

    labels = LABELS


CAUSE_EXPLAINERS = {
    "gpca": ExplainerEntry("GP-CA (aligned source)", CauseGPCA, ("source",), reads="embeddings"),
    "softmax_head": ExplainerEntry("Softmax head (aligned source)", CauseHead, ("source",), reads="embeddings"),
    "concept_vectors": ExplainerEntry("Concept activation vectors", CauseVectors, ("source",), reads="embeddings"),
}
