"""Gates: one number of the registration itself decides whether it is fine. They name no cause."""

from dataclasses import replace
from functools import partial
from typing import Self

import numpy as np

from gpca.causes.dataset import LABELS
from gpca.causes.settings import MOTION
from gpca.causes.truth import NOMINAL
from gpca.classifier.scores import Attribution
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer, attached
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.settings import Positive
from gpca.uncertainty.settings import UncertaintySettings

assert LABELS[0] == NOMINAL  # scores have its column first


class NominalThreshold:
    """Turns an alarm (larger is worse) and the scores of the causes into scores over `LABELS`."""

    accuracy = 0.5

    def fit(self, alarm_N: np.ndarray, label_N: np.ndarray) -> Self:
        """Find the scale of the alarm, and the threshold with the best balanced accuracy; the median if undefined."""
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
        """Return scores (N, 4) with sum one: of nominal, and of the causes in proportion to their shares."""
        from scipy.special import expit

        wrong_N = expit((alarm_N - self._threshold) / self._scale)
        nominal_N = (1 - wrong_N) * shares_N_3.max(axis=1)
        scores_N_4 = np.column_stack([nominal_N, wrong_N[:, None] * shares_N_3])
        return scores_N_4 / scores_N_4.sum(axis=1, keepdims=True)


class Alarm(ScoringExplainer):
    """Base of explainers that raise an alarm and name no cause."""

    labels = LABELS

    def fit(self, registrations: Registrations) -> None:
        self._threshold = NominalThreshold().fit(self.alarm(registrations), registrations.concept)

    def explain(self, registrations: Registrations) -> Attribution:
        return replace(super().explain(registrations), abstained_N=np.ones(len(registrations), bool))

    def scores(self, registrations: Registrations) -> np.ndarray:
        even_N_3 = np.full((len(registrations), len(CONCEPTS)), 1 / len(CONCEPTS))
        return self._threshold.scores(self.alarm(registrations), even_N_3)

    def alarm(self, registrations: Registrations) -> np.ndarray:
        """Return the alarm (N,)."""
        raise NotImplementedError


class Gate(Alarm):
    """An alarm by one of the numbers of :data:`gpca.causes.settings.MOTION`."""

    def __init__(self, name: str, source: str, seed: int) -> None:
        self._name = name

    def alarm(self, registrations: Registrations) -> np.ndarray:
        return motion_alarm(registrations, self._name)


def motion_alarm(registrations: Registrations, name: str) -> np.ndarray:
    """Return one of the numbers of the motion (N,), with the sign by which large values are bad."""
    return (-1 if name == "fitness" else 1) * attached(registrations, "motion")[:, MOTION.index(name)]


class Covariance(Alarm):
    """The alarm is ln |Σ + εI| of the covariance that an untrained estimator gives at the result of ICP."""

    def __init__(self, estimator: str, source: str, seed: int, floor: Positive = 1e-12) -> None:
        self._estimator, self._floor = estimator, floor

    def alarm(self, registrations: Registrations) -> np.ndarray:
        from gpca.alignment.methods.interface import Outcome, Pair
        from gpca.uncertainty.estimators.interface import POINT_TO_POINT, RegisteredPair
        from gpca.uncertainty.estimators.registry import make_estimator
        from gpca.uncertainty.spread import log_determinant

        estimate, deviation_6 = make_estimator(self._estimator), UncertaintySettings().deviation_6()
        covariances = []
        for row in range(len(registrations)):
            # The source is already moved to ICP's result, so the pose is the identity.
            source, target = registrations.cloud(row), registrations.target(row)
            pair = Pair(source.astype(np.float64), target.astype(np.float64)).with_normals()
            outcome = Outcome(np.eye(4), float(registrations.fitness[row]), float(registrations.inlier_rmse[row]))
            estimated = estimate(RegisteredPair(pair, outcome, POINT_TO_POINT, deviation_6)).covariance_6_6
            covariances.append(np.eye(6) if estimated is None else estimated)
        return log_determinant(np.array(covariances).reshape(-1, 6, 6), self._floor)


# The determinant of the covariance over other starts needs no clean run.
GATES = ("inlier_rmse", "fitness", "log_determinant")
_by_motion = partial(ExplainerEntry, reads="descriptors")
CAUSE_EXPLAINERS = {
    "gate_rmse": _by_motion("Inlier RMSE (gate)", partial(Gate, "inlier_rmse"), ("pair",)),
    "gate_fitness": _by_motion("Fitness (gate)", partial(Gate, "fitness"), ("pair",)),
    "gate_spread": _by_motion("Spread of the runs (gate)", partial(Gate, "log_determinant"), ("runs",)),
    # In closed form (Censi 2007).
    "gate_censi": ExplainerEntry("Covariance by Censi (gate)", partial(Covariance, "censi"), ("pair",)),
    # Its sigma points are 12 further runs.
    "gate_brossard": ExplainerEntry("Covariance by Brossard (gate)", partial(Covariance, "brossard"), ("pair", "runs")),
}
