"""Gates by an estimated covariance: a pose that the clouds hardly hold is taken for a wrong one. They name no cause."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from baselines.gates import NominalThreshold
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import LABELS
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.settings import Positive
from gpca.uncertainty.settings import UncertaintySettings


class CovarianceGate(ScoringExplainer):
    """The alarm is ln |Σ + εI| of the covariance that an estimator gives at the result of ICP.

    A registration without an estimate, as nothing holds it, counts as one of covariance I.

    Args:
        estimator: by its name in the registry, one that learns nothing.
        source, seed: not used; nothing is drawn.
        floor: ε, of the variances.
    """

    labels = LABELS

    def __init__(self, estimator: str, source: str, seed: int, floor: Positive = 1e-12) -> None:
        self._estimator, self._floor = estimator, floor

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
        from gpca.alignment.methods.interface import Outcome, Pair
        from gpca.uncertainty.estimators.interface import POINT_TO_POINT, RegisteredPair
        from gpca.uncertainty.estimators.registry import make_estimator
        from gpca.uncertainty.spread import log_determinant

        estimate, deviation_6 = make_estimator(self._estimator), UncertaintySettings().deviation_6()
        covariances = []
        for row in range(len(registrations)):
            # The source lies where ICP put it, so the pose is the identity.
            source, target = registrations.cloud(row), registrations.target(row)
            pair = Pair(source.astype(np.float64), target.astype(np.float64)).with_normals()
            outcome = Outcome(np.eye(4), float(registrations.fitness[row]), float(registrations.inlier_rmse[row]))
            estimated = estimate(RegisteredPair(pair, outcome, POINT_TO_POINT, deviation_6)).covariance_6_6
            covariances.append(np.eye(6) if estimated is None else estimated)
        return log_determinant(np.array(covariances).reshape(-1, 6, 6), self._floor)


CAUSE_EXPLAINERS = {
    "gate_censi": ExplainerEntry(
        "Covariance by Censi (gate)", partial(CovarianceGate, "censi"), ("pair",)
    ),  # in closed form (Censi 2007)
    "gate_brossard": ExplainerEntry(
        "Covariance by Brossard (gate)", partial(CovarianceGate, "brossard"), ("pair", "runs")
    ),  # its sigma points are 12 further runs
}
