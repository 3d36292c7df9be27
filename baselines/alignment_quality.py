"""Learned classifiers of alignment: whether two clouds lie on each other as they should. They name no cause.

``alarm_entropies`` is CorAl (Adolfsson et al. 2021): a regression on the mean entropy of the clouds, joint and apart.
``alarm_features`` reads what FACT (Dillén, Forssén & Edstedt 2025) does: local features of both aligned clouds, how far
each lies from the other, and how much of them is seen in both; boosted trees stand in the place of its network.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from baselines.descriptors import CLOUDS, described, entry
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import LABELS
from gpca.causes.descriptors import EVERYTHING, Columns
from gpca.causes.truth import NOMINAL
from gpca.explainers.boosted_trees import boosted_trees
from gpca.explainers.concept_classifier import standardized_regression
from gpca.explainers.interface import ScoringExplainer
from gpca.explainers.sight import Sees
from gpca.pairs.dataset import Registrations
from gpca.pairs.distances import ENTROPY
from gpca.pairs.perturbation import CONCEPTS
from gpca.settings import Count, Positive

JOINT_AND_APART = [row for row, name in enumerate(ENTROPY) if name.startswith(("joint", "apart"))]


class AlignmentClassifier(ScoringExplainer):
    """The probability of a failure, by a scikit-learn classifier that learned the nominal from the failed.

    Args:
        classifier: an unfitted classifier with ``predict_proba``.
        sees: the parts that it reads descriptors of.
        wanted: of these, its columns.
    """

    labels = LABELS

    def __init__(self, classifier, sees: Sees, wanted: Columns = EVERYTHING) -> None:
        self._classifier = classifier
        self._sees = sees
        self._wanted = wanted
        self._constant: float | None = None

    def fit(self, registrations: Registrations) -> None:
        """Learn from labeled registrations; where all are nominal, or all failed, that is the answer for all."""
        failed_N = registrations.concept != NOMINAL
        self._constant = float(failed_N.mean()) if failed_N.all() or not failed_N.any() else None
        if self._constant is None:
            self._classifier.fit(described(registrations, self._sees, self._wanted), failed_N)

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration, and name no cause of any."""
        return replace(super().explain(registrations), abstained_N=np.ones(len(registrations), bool))

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return scores (N, 4) that add up to one; a failure as probable as not has that of nominal for each cause."""
        if self._constant is None:
            features_N_F = described(registrations, self._sees, self._wanted)
            failure_N = self._classifier.predict_proba(features_N_F)[:, 1]
        else:
            failure_N = np.full(len(registrations), self._constant)
        scores_N_4 = np.column_stack([1 - failure_N, *(failure_N for _ in CONCEPTS)])
        return scores_N_4 / scores_N_4.sum(axis=1, keepdims=True)


def alarm_entropies(sees: Sees, source: str, seed: int, inverse_regularisation: Positive = 1.0) -> AlignmentClassifier:
    """Make CorAl's classifier."""
    return AlignmentClassifier(standardized_regression(inverse_regularisation), sees, {"entropy": JOINT_AND_APART})


def alarm_features(sees: Sees, source: str, seed: int, iterations: Count = 150) -> AlignmentClassifier:
    """Make the classifier on FACT's kind of features."""
    return AlignmentClassifier(boosted_trees(source, seed, "alignment", iterations=iterations), sees)


CAUSE_EXPLAINERS = {
    "alarm_entropies": entry("Aligned or not by entropies, CorAl", alarm_entropies, CLOUDS),
    "alarm_features": entry("Aligned or not by local features, after FACT", alarm_features, CLOUDS),
}
