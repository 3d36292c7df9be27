"""Explainers of causes that learn from the descriptors of a pair (:mod:`gpca.features`) with any classifier."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from baselines.attached import attached
from gpca.causes.labels import LABELS
from gpca.explainers.concept_classifier import ClassifierExplainer
from gpca.pairs.dataset import Registrations


class DescriptorClassifier(ClassifierExplainer):
    """Scores are the probabilities of a scikit-learn classifier on some groups of descriptors.

    Args:
        classifier: an unfitted classifier with ``predict_proba``.
        groups: names in :data:`gpca.features.groups.GROUPS`.
        columns: of all of them together, those that it reads; None for all.
    """

    labels = LABELS

    def __init__(self, classifier, groups: Sequence[str], columns: Sequence[int] | None = None) -> None:
        super().__init__(classifier)
        self._groups = groups
        self._columns = columns

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the columns that it reads."""
        joined_N_F = joined(registrations, self._groups)
        return joined_N_F if self._columns is None else joined_N_F[:, list(self._columns)]


def joined(registrations: Registrations, groups: Sequence[str]) -> np.ndarray:
    """Return these groups of descriptors side by side (N, F), of registrations that they are attached to."""
    return np.hstack([attached(registrations, group, None) for group in groups])
