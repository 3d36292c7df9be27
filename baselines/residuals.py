"""Three plain numbers of a registration and an ordinary classifier: the rival that a referee asks for first."""

from functools import partial

import numpy as np

from baselines.values import charged
from gpca.classifier.scores import Attribution
from gpca.explainers.classifiers import standardized_regression
from gpca.explainers.interface import ClassifierExplainer, ExplainerEntry, attached, measured
from gpca.pairs.dataset import Registrations
from gpca.seeds import seed_of
from gpca.settings import Count, Positive

FLOOR = 1e-6  # variance, as that of the uncertainty itself: a thousandth of a radian or of the diameter, squared
OBSERVED = 0  # the condition of the uncertainty design that leaves the observed pair as it is


class Residuals(ClassifierExplainer):
    """A classifier on log residuals both ways and the log-determinant of the covariance plus `floor` ε I."""

    def __init__(self, classifier, floor: float) -> None:
        super().__init__(classifier)
        self._floor = floor

    def describe(self, registrations: Registrations) -> Registrations:
        return measured(registrations, "residuals_", lambda: {"both_ways": residuals(registrations)})

    def features(self, registrations: Registrations) -> np.ndarray:
        from gpca.uncertainty.spread import log_determinant

        log_determinant_N = log_determinant(attached(registrations, "covariance")[:, OBSERVED], self._floor)
        return np.column_stack([self.describe(registrations).attached["residuals_both_ways"], log_determinant_N])

    def explain(self, registrations: Registrations) -> Attribution:
        return charged(super().explain(registrations), registrations, [OBSERVED])


def residuals(registrations: Registrations) -> np.ndarray:
    """Return (N, 2): log of the RMS distance, in diameters, from source to target and from target to source."""
    from scipy.spatial import cKDTree

    from gpca.uncertainty.spread import log_residual

    pairs = [(registrations.cloud(i), registrations.target(i)) for i in range(len(registrations))]
    return np.array([[log_residual(one, cKDTree(other)) for one, other in (pair, pair[::-1])] for pair in pairs])


def logistic(source: str, seed: int, inverse_regularisation: Positive = 1.0, floor: Positive = FLOOR) -> Residuals:
    return Residuals(standardized_regression(inverse_regularisation), floor)


def forest(source: str, seed: int, trees: Count = 200, floor: Positive = FLOOR) -> Residuals:
    from sklearn.ensemble import RandomForestClassifier

    random_state = seed_of(source, seed, "residuals_forest") % 2**32
    return Residuals(RandomForestClassifier(n_estimators=trees, random_state=random_state), floor)


_entry = partial(ExplainerEntry, sees=("pair", "runs"), reads="uncertainty/removal", observed_only=True)
EXPLAINERS = {
    "residuals_logistic": _entry("Residuals (logistic regression)", logistic),
    "residuals_forest": _entry("Residuals (random forest)", forest),
}
