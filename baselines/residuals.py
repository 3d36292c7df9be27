"""Three plain numbers of a registration and an ordinary classifier: the rival that a referee asks for first.

Noise moves the aligned source off the target's surface, so the forward residual (source to target) grows; a missing
part leaves target points without a partner, so the backward residual (target to source) grows; a poor pose does both,
and spreads the Monte-Carlo poses of ICP. Like GP-CA it learns from the labels of the training split.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from gpca.attribution.scores import Attribution
from gpca.explainers.concept_classifier import ClassifierExplainer, standardized_regression
from gpca.explainers.interface import ExplainerEntry, attached, measured
from gpca.pairs.dataset import Registrations
from gpca.seeds import seed_of
from gpca.settings import Count, Positive

FLOOR = 1e-6  # variance, as that of the uncertainty itself: a thousandth of a radian or of the diameter, squared
OBSERVED = 0  # the condition of the uncertainty design in which the observed pair is left as it is


class Residuals(ClassifierExplainer):
    """A classifier on log forward residual, log backward residual and the log-determinant of the pose covariance.

    Reads ``covariance`` (S, K, 6, 6), ``icp_calls``, ``seconds`` and ``icp_seconds`` (S, K), of which only the
    observed condition is used and charged.

    Args:
        classifier: an unfitted scikit-learn classifier.
        floor: ε, added to the variances so that a pair whose runs all end at one pose has a determinant.
    """

    def __init__(self, classifier, floor: float) -> None:
        super().__init__(classifier)
        self._floor = floor

    def describe(self, registrations: Registrations) -> Registrations:
        """Attach the residuals of both directions, unless they are attached already."""
        return measured(registrations, "residuals_", lambda: {"both_ways": residuals(registrations)})

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return :func:`features` with this floor."""
        return features(registrations, self._floor)

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration by the classifier's probabilities, and charge the observed condition."""
        attribution = super().explain(registrations)
        return replace(
            attribution,
            seconds_N=attribution.seconds_N + _observed(registrations, "seconds"),
            icp_seconds_N=_observed(registrations, "icp_seconds"),
            icp_calls_N=_observed(registrations, "icp_calls").astype(int),
        )


def features(registrations: Registrations, floor: float) -> np.ndarray:
    """Return (N, 3): log forward and log backward residual (of diameters), log-determinant of covariance plus floor.

    Raises:
        InputError: no covariance is attached, or it holds NaN.
    """
    from gpca.uncertainty.spread import log_determinant

    log_determinant_N = log_determinant(attached(registrations, "covariance")[:, OBSERVED], floor)
    described = measured(registrations, "residuals_", lambda: {"both_ways": residuals(registrations)})
    return np.column_stack([described.attached["residuals_both_ways"], log_determinant_N])


def residuals(registrations: Registrations) -> np.ndarray:
    """Return (N, 2): log forward and log backward residual of every registration, of diameters."""
    pairs = [(registrations.cloud(i), registrations.target(i)) for i in range(len(registrations))]
    return np.array([(log_residual(source, target), log_residual(target, source)) for source, target in pairs])


def log_residual(from_P_3: np.ndarray, to_Q_3: np.ndarray) -> float:
    """Return the log of the RMS distance from each point of one cloud to the nearest of the other."""
    from scipy.spatial import cKDTree

    from gpca.uncertainty.spread import log_residual as to_tree

    return to_tree(from_P_3, cKDTree(to_Q_3))


def _observed(registrations: Registrations, name: str) -> np.ndarray:
    return attached(registrations, name)[:, OBSERVED]


def residuals_logistic(
    source: str, seed: int, inverse_regularisation: Positive = 1.0, floor: Positive = FLOOR
) -> Residuals:
    """Make the rival with logistic regression."""
    return Residuals(standardized_regression(inverse_regularisation), floor)


def residuals_forest(source: str, seed: int, trees: Count = 200, floor: Positive = FLOOR) -> Residuals:
    """Make the rival with a random forest."""
    from sklearn.ensemble import RandomForestClassifier

    random_state = seed_of(source, seed, "residuals_forest") % 2**32
    return Residuals(RandomForestClassifier(n_estimators=trees, random_state=random_state), floor)


_entry = partial(ExplainerEntry, sees=("pair", "runs"), reads="uncertainty/removal", observed_only=True)
EXPLAINERS = {
    "residuals_logistic": _entry("Residuals (logistic regression)", residuals_logistic),
    "residuals_forest": _entry("Residuals (random forest)", residuals_forest),
}
