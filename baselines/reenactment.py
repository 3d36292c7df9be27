"""Explainers that read a re-enactment of each pair (docs/reenactment.md): one untrained, one a committee."""

from __future__ import annotations

import numpy as np

from baselines.descriptors import Committee, randomized_trees
from gpca.causes.dataset import LABELS
from gpca.explainers.classifiers import boosted_trees
from gpca.explainers.gpca import DescriptorGPCA
from gpca.explainers.interface import REENACTED, ClassifierExplainer, ExplainerEntry, ScoringExplainer, Sees, attached
from gpca.pairs.dataset import Registrations

SEES: Sees = ("pair", "motion", "runs", "reenactment")
VERDICT, NUMBERS = "verdict", "reenactment"  # attached arrays


class Reenact(ScoringExplainer):
    """Scores are the probabilities of the re-enactment itself (:mod:`gpca.reenactment.dataset`)."""

    labels = LABELS

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the probabilities of nominal and of each cause being dominant."""
        return attached(registrations, VERDICT)


class ReenactmentClassifier(ClassifierExplainer):
    """Scores are the probabilities of a scikit-learn classifier on the numbers of the re-enactment."""

    labels = LABELS

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the numbers."""
        return attached(registrations, NUMBERS)


class ReenactmentGPCA(DescriptorGPCA):
    """GP-CA's classifier on the numbers of the re-enactment."""

    labels = LABELS

    def __init__(self, source: str, seed: int) -> None:
        super().__init__((source, seed, "reenactment"), source, seed, learning_rate=0.1, iterations=200)

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the numbers."""
        return attached(registrations, NUMBERS)


class ReenactmentCommittee(Committee):
    """The committee of three, on the numbers of the re-enactment, which include the pair's descriptors."""

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
