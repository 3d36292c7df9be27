"""Learned classifiers of alignment: whether two clouds are aligned. They name no cause.

``alarm_entropies`` is CorAl (Adolfsson et al. 2021): a regression on the mean entropy of the clouds, joint and apart.
``alarm_features`` reads features like FACT's (Dillén, Forssén & Edstedt 2025): local features of both aligned clouds,
their distances, and the share seen in both; boosted trees replace its network.
"""

from __future__ import annotations

import numpy as np

from baselines.descriptors import CLOUDS, described, entry
from baselines.gates import Alarm
from gpca.causes.descriptors import EVERYTHING, Columns
from gpca.causes.truth import NOMINAL
from gpca.explainers.classifiers import boosted_trees, standardized_regression
from gpca.explainers.interface import Sees
from gpca.pairs.dataset import Registrations
from gpca.pairs.distances import ENTROPY
from gpca.pairs.perturbation import CONCEPTS
from gpca.settings import Count, Positive

JOINT_AND_APART = [row for row, name in enumerate(ENTROPY) if name.startswith(("joint", "apart"))]


class AlignmentClassifier(Alarm):
    """Probability of a failure by an unfitted scikit-learn classifier on the `wanted` columns of the parts it sees."""

    def __init__(self, classifier, sees: Sees, wanted: Columns = EVERYTHING) -> None:
        self._classifier, self._sees, self._wanted = classifier, sees, wanted
        self._constant: float | None = None

    def fit(self, registrations: Registrations) -> None:
        """Learn from labeled registrations; if all are nominal, or all failed, predict the same for all."""
        failed_N = registrations.concept != NOMINAL
        self._constant = float(failed_N.mean()) if failed_N.all() or not failed_N.any() else None
        if self._constant is None:
            self._classifier.fit(described(registrations, self._sees, self._wanted), failed_N)

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return scores (N, 4) with sum one; at a failure probability of 0.5, each cause equals nominal."""
        if self._constant is None:
            features_N_F = described(registrations, self._sees, self._wanted)
            failure_N = self._classifier.predict_proba(features_N_F)[:, 1]
        else:
            failure_N = np.full(len(registrations), self._constant)
        scores_N_4 = np.column_stack([1 - failure_N, *(failure_N for _ in CONCEPTS)])
        return scores_N_4 / scores_N_4.sum(axis=1, keepdims=True)


def alarm_entropies(sees: Sees, source: str, seed: int, inverse_regularisation: Positive = 1.0) -> AlignmentClassifier:
    return AlignmentClassifier(standardized_regression(inverse_regularisation), sees, {"entropy": JOINT_AND_APART})


def alarm_features(sees: Sees, source: str, seed: int, iterations: Count = 150) -> AlignmentClassifier:
    return AlignmentClassifier(boosted_trees(source, seed, "alignment", iterations=iterations), sees)


CAUSE_EXPLAINERS = {
    "alarm_entropies": entry("Aligned or not by entropies, CorAl", alarm_entropies, CLOUDS),
    "alarm_features": entry("Aligned or not by local features, after FACT", alarm_features, CLOUDS),
}
