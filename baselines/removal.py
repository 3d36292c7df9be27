"""SHAP and sensitivity analysis over remedies: the cause whose remedy moves the result most is named.

The worth is v̂, how far the result lies from that with all remedies (:mod:`gpca.causes.remedied`). A remedy moves
every result a little, so its values are counted in standard deviations from their mean over the nominal samples. With
all causes left alone, v̂ is the alarm that tells whether anything is wrong.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from baselines.gates import NominalThreshold
from baselines.sensitivity import single_drops
from baselines.shap_kl import shapley_values
from gpca.causes.dataset import LABELS
from gpca.causes.shapley import ALL, SUBSETS
from gpca.causes.truth import NOMINAL
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer, attached
from gpca.pairs.dataset import Registrations

SMALLEST = 1e-4  # diameters: what a remedy moves less is rounding and chance


class RemovalValues(ScoringExplainer):
    """Values (N, 3) of the remedies by v̂ of the eight subsets.

    Args:
        values: v̂ (N, 8) -> the values.
        source, seed: not used; nothing is drawn.
    """

    labels = LABELS

    def __init__(self, values: Callable[[np.ndarray], np.ndarray], source: str, seed: int) -> None:
        self._values = values

    def fit(self, registrations: Registrations) -> None:
        """Learn the scatter of each value where nothing is wrong, and the threshold of the alarm."""
        errors_N_8 = _errors(registrations)
        nominal_N = registrations.concept == NOMINAL
        scatter_N_3 = self._values(errors_N_8[nominal_N] if nominal_N.any() else errors_N_8)
        self._mean_3 = scatter_N_3.mean(axis=0)
        self._deviation_3 = np.maximum(scatter_N_3.std(axis=0), SMALLEST)
        self._threshold = NominalThreshold().fit(_alarm(errors_N_8), registrations.concept)

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Score every registration by its scaled values."""
        from scipy.special import softmax

        errors_N_8 = _errors(registrations)
        shares_N_3 = softmax((self._values(errors_N_8) - self._mean_3) / self._deviation_3, axis=1)
        return self._threshold.scores(_alarm(errors_N_8), shares_N_3)


def _errors(registrations: Registrations) -> np.ndarray:
    return attached(registrations, "remedied")[:, : len(SUBSETS)]


def _alarm(errors_N_8: np.ndarray) -> np.ndarray:
    return np.log(np.maximum(errors_N_8[:, ALL], SMALLEST))


def _single_remedies(errors_N_8: np.ndarray) -> np.ndarray:
    """Return the change that each remedy makes alone (N, 3)."""
    return single_drops(-errors_N_8[:, ::-1])


CAUSE_EXPLAINERS = {
    "shap_removal": ExplainerEntry(
        "SHAP, remedies", partial(RemovalValues, shapley_values), ("remedies",), reads="descriptors"
    ),
    "sa_removal": ExplainerEntry(
        "SA, remedies", partial(RemovalValues, _single_remedies), ("remedies",), reads="descriptors"
    ),
}
