"""Explainers that read a re-enactment of each pair (docs/reenactment.md): one untrained, one a committee."""

from __future__ import annotations

import numpy as np

from baselines.descriptor_gpca import Committee
from baselines.descriptors import boosted_trees, randomized_trees
from gpca.causes.dataset import LABELS
from gpca.explainers.concept_classifier import ClassifierExplainer
from gpca.explainers.gpca import DescriptorGPCA
from gpca.explainers.interface import REENACTED, ExplainerEntry, ScoringExplainer, attached
from gpca.explainers.sight import Sees
from gpca.pairs.dataset import Registrations

SEES: Sees = ("pair", "motion", "runs", "reenactment")
VERDICT, NUMBERS = "verdict", "reenactment"  # names of what is attached


class Reenact(ScoringExplainer):
    """Scores are the probabilities that the re-enactment itself gives (:mod:`gpca.reenactment.verdict`).

    Args:
        source, seed: not used; nothing is drawn.
    """

    labels = LABELS

    def __init__(self, source: str, seed: int) -> None:
        pass

    def fit(self, registrations: Registrations) -> None:
        """Do nothing, since nothing is learned."""

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the probabilities of nominal and of each cause to be the dominant one."""
        return attached(registrations, VERDICT)


class ReenactmentClassifier(ClassifierExplainer):
    """Scores are the probabilities of a scikit-learn classifier on the numbers of the re-enactment."""

    labels = LABELS

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return those numbers."""
        return attached(registrations, NUMBERS)


class ReenactmentGPCA(DescriptorGPCA):
    """GP-CA's classifier on the numbers of the re-enactment."""

    labels = LABELS

    def __init__(self, source: str, seed: int) -> None:
        super().__init__((source, seed, "reenactment"), source, seed, learning_rate=0.1, iterations=200)

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return those numbers."""
        return attached(registrations, NUMBERS)


class ReenactmentCommittee(Committee):
    """The committee of three unlike kinds, on the numbers of the re-enactment and the pair's descriptors."""

    def __init__(self, source: str, seed: int) -> None:
        self._members = [
            ReenactmentClassifier(randomized_trees(source, seed)),
            ReenactmentClassifier(boosted_trees(source, seed)),
            ReenactmentGPCA(source, seed),
        ]


CAUSE_EXPLAINERS = {
    "reenact": ExplainerEntry("Re-enactment (untrained)", Reenact, SEES, reads=REENACTED),
    "reenact_committee": ExplainerEntry("Committee on the re-enactment", ReenactmentCommittee, SEES, reads=REENACTED),
}
