"""What SHAP and sensitivity analysis share: turning values per concept and registration into an attribution.

Values of knobs are used directly. A remedy may lower the uncertainty of every pair a little, so without labels its
values are standardized over the training split; with labels a classifier reads them.
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Literal, get_args

import numpy as np

from baselines.gates import NominalThreshold
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import LABELS
from gpca.causes.truth import ALL, NOMINAL, SUBSETS
from gpca.errors import InputError
from gpca.explainers.classifiers import standardized_regression
from gpca.explainers.interface import ClassifierExplainer, ScoringExplainer, attached
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.settings import Positive

Values = Callable[[np.ndarray], np.ndarray]  # from the worth (S, K) of the conditions to values (S, 3)
Worth = Literal["uncertainty", "residual"]  # of a condition: KL in nats, or log distance from target to source
WORTHS: tuple[str, ...] = get_args(Worth)
SMALLEST = 1e-4  # diameters: smaller changes are rounding and chance


class ChargedValues(ScoringExplainer):
    """Base of explainers that are charged with the conditions of a design that they need; None stands for all."""

    def __init__(self, conditions: list[int] | None) -> None:
        self._conditions = conditions

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration by its values."""
        started = perf_counter()
        return charged(registrations, self.scores(registrations), self._conditions, started)


def charged(
    registrations: Registrations, scores_N_3: np.ndarray, conditions: list[int] | None, started: float
) -> Attribution:
    """Make an attribution charged with the conditions and the time since `started`; equal scores name no concept."""
    own_seconds = (perf_counter() - started) / len(registrations)
    columns = slice(None) if conditions is None else conditions
    cost = {
        name: attached(registrations, name)[:, columns].sum(axis=1) for name in ("seconds", "icp_seconds", "icp_calls")
    }
    return Attribution.of_scores(
        CONCEPTS,
        scores_N_3,
        seconds=cost["seconds"] + own_seconds,
        icp_seconds=cost["icp_seconds"],
        icp_calls=cost["icp_calls"],
        abstained_N=np.ptp(scores_N_3, axis=1) == 0,
    )


class KnobValues(ChargedValues):
    """The knob with the largest value of the uncertainty names the concept; nothing is learned."""

    def __init__(self, values: Values, conditions: list[int] | None, source: str, seed: int) -> None:
        super().__init__(conditions)
        self._values = values

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the values."""
        return self._values(attached(registrations, "uncertainty"))


class ScaledValues(ChargedValues):
    """The remedy with the largest standardized drop of the worth names the concept; no labels are used."""

    def __init__(
        self, values: Values, conditions: list[int], source: str, seed: int, worth: Worth = "uncertainty"
    ) -> None:
        if worth not in WORTHS:
            raise InputError("setting 'worth'", f"unknown '{worth}'", f"choose one of {', '.join(WORTHS)}")
        super().__init__(conditions)
        self._values, self._worth = values, worth

    def fit(self, registrations: Registrations) -> None:
        """Learn mean and standard deviation of each value."""
        values_N_3 = self._values(-corners(registrations, self._worth))
        self._mean_3 = values_N_3.mean(axis=0)
        self._deviation_3 = np.maximum(values_N_3.std(axis=0), 1e-9)

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the scaled values."""
        return (self._values(-corners(registrations, self._worth)) - self._mean_3) / self._deviation_3


class LearnedValues(ChargedValues, ClassifierExplainer):
    """Logistic regression on the values of the remedies by both worths, with the same labels as GP-CA."""

    def __init__(
        self,
        values: Values,
        conditions: list[int],
        source: str,
        seed: int,
        inverse_regularisation: Positive = 1.0,
    ) -> None:
        ChargedValues.__init__(self, conditions)
        ClassifierExplainer.__init__(self, standardized_regression(inverse_regularisation))
        self._values = values

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the values of the remedies by both worths."""
        return np.hstack([self._values(-corners(registrations, worth)) for worth in WORTHS])


def corners(registrations: Registrations, worth: str) -> np.ndarray:
    """Return one worth of the 8 corners (S, 8): corner b has feature i present where bit i of b is set."""
    return attached(registrations, worth)[:, :8]


class RemovalValues(ScoringExplainer):
    """Causes by remedies: the cause whose remedy moves the result most is named.

    The worth of a subset of remedies is v̂, the distance of the result from that with all remedies
    (:mod:`gpca.causes.descriptors`). A remedy moves every result a little, so `values`, from v̂ (N, 8), are standardized
    over the nominal samples. v̂ with all causes left alone is the alarm for the label nominal.
    """

    labels = LABELS

    def __init__(self, values: Values, source: str, seed: int) -> None:
        self._values = values

    def fit(self, registrations: Registrations) -> None:
        """Learn the scatter of each value in nominal samples, and the threshold of the alarm."""
        errors_N_8 = self._errors(registrations)
        nominal_N = registrations.concept == NOMINAL
        scatter_N_3 = self._values(errors_N_8[nominal_N] if nominal_N.any() else errors_N_8)
        self._mean_3 = scatter_N_3.mean(axis=0)
        self._deviation_3 = np.maximum(scatter_N_3.std(axis=0), SMALLEST)
        self._threshold = NominalThreshold().fit(self._alarm(errors_N_8), registrations.concept)

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Score every registration by its scaled values."""
        from scipy.special import softmax

        errors_N_8 = self._errors(registrations)
        shares_N_3 = softmax((self._values(errors_N_8) - self._mean_3) / self._deviation_3, axis=1)
        return self._threshold.scores(self._alarm(errors_N_8), shares_N_3)

    def _errors(self, registrations: Registrations) -> np.ndarray:
        return attached(registrations, "remedied")[:, : len(SUBSETS)]

    def _alarm(self, errors_N_8: np.ndarray) -> np.ndarray:
        return np.log(np.maximum(errors_N_8[:, ALL], SMALLEST))
