"""The encoder's own softmax head, which GP-CA drops: what the Gaussian process adds is measured against it."""

from __future__ import annotations

from time import perf_counter

from baselines.attached import attached
from gpca.attribution.scores import Attribution
from gpca.explainers.interface import ExplainerEntry
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS


class SoftmaxHead:
    """Scores are the softmax of the head's logits, averaged over the draws from a cloud as the embedding is.

    Attributes:
        labels: what it names.
        trained_with_encoder: labels that are given to ``fit`` teach it nothing.
    """

    labels: tuple[str, ...] = CONCEPTS
    trained_with_encoder = True

    def __init__(self, source: str, seed: int) -> None:
        pass

    def fit(self, registrations: Registrations) -> None:
        """Do nothing: the head was trained with the encoder, on the same training rows."""

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration."""
        from scipy.special import softmax

        started = perf_counter()
        scores_N_C = softmax(attached(registrations, "head_logits", len(self.labels)), axis=1)
        return Attribution.of_scores(self.labels, scores_N_C, seconds=(perf_counter() - started) / len(registrations))


EXPLAINERS = {"softmax_head": ExplainerEntry("Softmax head", SoftmaxHead, reads="embeddings")}
