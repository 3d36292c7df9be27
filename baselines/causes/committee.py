"""A committee: the mean of the scores of a forest, of boosting and of GP-CA, each on every descriptor of the pair."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from baselines.causes.described import DescribedPairs
from baselines.causes.gaussian_processes import PairGPCA
from baselines.causes.trees import boosted_trees, randomised_trees
from gpca.attribution.scores import Attribution
from gpca.causes.labels import LABELS
from gpca.descriptors.groups import GROUPS
from gpca.explainers.interface import ConceptExplainer, ExplainerEntry
from gpca.pairs.dataset import Registrations


class Committee:
    """Three explainers of unlike kinds, whose errors are not the same."""

    def __init__(self, source: str, seed: int) -> None:
        self._members: list[ConceptExplainer] = [
            DescribedPairs(randomised_trees(source, seed), GROUPS),
            DescribedPairs(boosted_trees(source, seed), GROUPS),
            PairGPCA(source, seed, learning_rate=0.1, iterations=200),
        ]

    def fit(self, registrations: Registrations) -> None:
        """Fit every member."""
        for member in self._members:
            member.fit(registrations)

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration by the mean."""
        started = perf_counter()
        scores_N_C = np.mean([member.explain(registrations).scores_N_C for member in self._members], axis=0)
        return Attribution.of_scores(LABELS, scores_N_C, seconds=(perf_counter() - started) / len(registrations))


EXPLAINERS = {"pair_committee": ExplainerEntry("Committee on the pair", Committee, reads="descriptors")}
