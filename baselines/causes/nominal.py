"""A class "nominal" for methods that have none: below the best threshold of their own alarm nothing is wrong."""

from __future__ import annotations

import numpy as np

from gpca.causes.labels import LABELS
from gpca.causes.truth import NOMINAL


class NominalThreshold:
    """Turns an alarm (larger is worse) and the scores of the causes into scores over `LABELS`."""

    def fit(self, alarm_N: np.ndarray, label_N: np.ndarray) -> NominalThreshold:
        """Find the threshold of the best balanced accuracy on labeled samples, and the scale of the alarm.

        Where one of the two is missing among the labels, the threshold is the median.
        """
        nominal_N = label_N == NOMINAL
        order = np.argsort(alarm_N, kind="stable")
        if nominal_N.all() or not nominal_N.any():
            self._threshold = float(np.median(alarm_N))
        else:
            found_N = np.cumsum(nominal_N[order]) / nominal_N.sum()
            lost_N = np.cumsum(~nominal_N[order]) / (~nominal_N).sum()
            best = int(np.argmax(found_N - lost_N))
            following = min(best + 1, len(order) - 1)
            self._threshold = float(alarm_N[order[[best, following]]].mean())
        self._scale = max(float(np.quantile(alarm_N, 0.75) - np.quantile(alarm_N, 0.25)), 1e-9)
        return self

    def scores(self, alarm_N: np.ndarray, shares_N_3: np.ndarray) -> np.ndarray:
        """Return scores (N, 4) that add up to one: of nominal, and of the causes in these shares of the rest.

        At the threshold nominal has as much as the largest cause, so the label named is the threshold's.
        """
        from scipy.special import expit

        wrong_N = expit((alarm_N - self._threshold) / self._scale)
        largest_N = shares_N_3.max(axis=1)
        nominal_N = (1 - wrong_N) * largest_N
        causes_N_3 = wrong_N[:, None] * shares_N_3
        scores_N_4 = np.column_stack([nominal_N, causes_N_3])
        return scores_N_4 / scores_N_4.sum(axis=1, keepdims=True)


assert LABELS[0] == NOMINAL  # scores have its column first
