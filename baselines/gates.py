"""Gates: one number that the registration itself gives, read as "is it fine?". They name no cause.

Below the best threshold of an alarm nothing is wrong: so a method that has no class "nominal" gets one.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from gpca.attribution.scores import Attribution
from gpca.causes.dataset import LABELS
from gpca.causes.settings import MOTION
from gpca.causes.truth import NOMINAL
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer, attached
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS


class NominalThreshold:
    """Turns an alarm (larger is worse) and the scores of the causes into scores over `LABELS`.

    Attributes:
        accuracy: balanced, of the threshold on the labeled samples; a half where it cannot be told.
    """

    accuracy = 0.5

    def fit(self, alarm_N: np.ndarray, label_N: np.ndarray) -> NominalThreshold:
        """Find the threshold of the best balanced accuracy on labeled samples, and the scale of the alarm.

        Where one of the two is missing among the labels, the threshold is the median.
        """
        nominal_N = label_N == NOMINAL
        order = np.argsort(alarm_N, kind="stable")
        if nominal_N.all() or not nominal_N.any():
            self._threshold = float(np.median(alarm_N))
        else:
            kept_N = np.cumsum(nominal_N[order]) / nominal_N.sum()
            lost_N = np.cumsum(~nominal_N[order]) / (~nominal_N).sum()
            best = int(np.argmax(kept_N - lost_N))
            self.accuracy = float(1 + kept_N[best] - lost_N[best]) / 2
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


class Gate(ScoringExplainer):
    """An alarm by one of the numbers of the motion.

    Args:
        name: in :data:`gpca.causes.settings.MOTION`.
        source, seed: not used; nothing is drawn.
    """

    labels = LABELS

    def __init__(self, name: str, source: str, seed: int) -> None:
        self._name = name

    def fit(self, registrations: Registrations) -> None:
        """Learn the threshold."""
        self._threshold = NominalThreshold().fit(alarm(registrations, self._name), registrations.concept)

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration, and name no cause of any."""
        return replace(super().explain(registrations), abstained_N=np.ones(len(registrations), bool))

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Score nominal by the alarm, and all causes alike."""
        even_N_3 = np.full((len(registrations), len(CONCEPTS)), 1 / len(CONCEPTS))
        return self._threshold.scores(alarm(registrations, self._name), even_N_3)


def alarm(registrations: Registrations, name: str) -> np.ndarray:
    """Return one of the numbers of the motion (N,), with the sign by which large values are bad."""
    return (-1 if name == "fitness" else 1) * attached(registrations, "motion")[:, MOTION.index(name)]


# The determinant of the covariance over other starts needs no clean run.
GATES = ("inlier_rmse", "fitness", "log_determinant")
CAUSE_EXPLAINERS = {
    "gate_rmse": ExplainerEntry("Inlier RMSE (gate)", partial(Gate, "inlier_rmse"), ("pair",), reads="descriptors"),
    "gate_fitness": ExplainerEntry("Fitness (gate)", partial(Gate, "fitness"), ("pair",), reads="descriptors"),
    "gate_spread": ExplainerEntry(
        "Spread of the runs (gate)", partial(Gate, "log_determinant"), ("runs",), reads="descriptors"
    ),
}
