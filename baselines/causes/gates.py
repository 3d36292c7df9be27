"""Gates: one number that the registration itself gives, read as "is it fine?". They name no cause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from baselines.attached import attached
from baselines.causes.nominal import NominalThreshold
from gpca.attribution.scores import Attribution
from gpca.causes.labels import LABELS
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer
from gpca.features.groups import MOTION
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS


class Gate(ScoringExplainer):
    """An alarm by one of the numbers of the motion, times a sign.

    Args:
        name: in :data:`gpca.features.groups.MOTION`.
        sign: −1 where small values are bad.
    """

    labels = LABELS

    def __init__(self, name: str, sign: int = 1) -> None:
        self._column = MOTION.index(name)
        self._sign = sign

    def fit(self, registrations: Registrations) -> None:
        """Learn the threshold."""
        self._threshold = NominalThreshold().fit(self._alarm(registrations), registrations.concept)

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration, and name no cause of any."""
        return replace(super().explain(registrations), abstained_N=np.ones(len(registrations), bool))

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Score nominal by the alarm, and all causes alike."""
        even_N_3 = np.full((len(registrations), len(CONCEPTS)), 1 / len(CONCEPTS))
        return self._threshold.scores(self._alarm(registrations), even_N_3)

    def _alarm(self, registrations: Registrations) -> np.ndarray:
        return self._sign * attached(registrations, "motion", len(MOTION))[:, self._column]


def gate_rmse(source: str, seed: int) -> Gate:
    """Make the gate on ICP's inlier RMSE."""
    return Gate("inlier_rmse")


def gate_fitness(source: str, seed: int) -> Gate:
    """Make the gate on ICP's fitness, the share of points with a partner."""
    return Gate("fitness", sign=-1)


def gate_spread(source: str, seed: int) -> Gate:
    """Make the gate on the log-determinant of the covariance over other starts, which needs no clean run."""
    return Gate("log_determinant")


EXPLAINERS = {
    "gate_rmse": ExplainerEntry("Inlier RMSE (gate)", gate_rmse, reads="descriptors"),
    "gate_fitness": ExplainerEntry("Fitness (gate)", gate_fitness, reads="descriptors"),
    "gate_spread": ExplainerEntry("Spread of the runs (gate)", gate_spread, reads="descriptors"),
}
