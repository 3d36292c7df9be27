"""A committee: the mean of the scores of a forest, of boosting and of GP-CA, each on every descriptor of the pair."""

from __future__ import annotations

import numpy as np

from baselines.causes.described import DescriptorClassifier
from baselines.causes.gaussian_processes import CausePairGPCA
from baselines.causes.trees import boosted_trees, randomized_trees
from gpca.causes.labels import LABELS
from gpca.explainers.interface import ConceptExplainer, ExplainerEntry, ScoringExplainer
from gpca.features.groups import GROUPS
from gpca.pairs.dataset import Registrations


class Committee(ScoringExplainer):
    """Three explainers of unlike kinds, whose errors are not the same."""

    labels = LABELS

    def __init__(self, source: str, seed: int) -> None:
        self._members: list[ConceptExplainer] = [
            DescriptorClassifier(randomized_trees(source, seed), GROUPS),
            DescriptorClassifier(boosted_trees(source, seed), GROUPS),
            CausePairGPCA(source, seed, learning_rate=0.1, iterations=200),
        ]

    def fit(self, registrations: Registrations) -> None:
        """Fit every member."""
        for member in self._members:
            member.fit(registrations)

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the mean of the members' scores."""
        return np.mean([member.explain(registrations).scores_N_C for member in self._members], axis=0)


EXPLAINERS = {"pair_committee": ExplainerEntry("Committee on the pair", Committee, reads="descriptors")}
