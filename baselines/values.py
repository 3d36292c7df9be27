"""What SHAP and sensitivity analysis share: turning values per concept and registration into an attribution."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np

from baselines.gates import NominalThreshold
from gpca.causes.dataset import LABELS
from gpca.causes.truth import ALL, NOMINAL, SUBSETS
from gpca.classifier.scores import Attribution
from gpca.explainers.classifiers import standardized_regression
from gpca.explainers.interface import ClassifierExplainer, ScoringExplainer, attached
from gpca.pairs.dataset import Registrations
from gpca.settings import Positive

Values = Callable[[np.ndarray], np.ndarray]  # from the worth (S, K) of the conditions to values (S, 3)
Worth = Literal["uncertainty", "residual"]  # of a condition: KL in nats, or log distance from target to source
WORTHS: tuple[str, ...] = get_args(Worth)
SMALLEST = 1e-4  # diameters: smaller changes are rounding and chance


def charged(attribution: Attribution, registrations: Registrations, conditions: list[int] | None) -> Attribution:
    """Return the attribution with the time and the runs of ICP of these conditions; None stands for all."""
    columns = slice(None) if conditions is None else conditions
    seconds_N, icp_seconds_N, icp_calls_N = (
        attached(registrations, name)[:, columns].sum(axis=1) for name in ("seconds", "icp_seconds", "icp_calls")
    )
    icp: dict[str, Any] = {"icp_seconds_N": icp_seconds_N, "icp_calls_N": icp_calls_N.astype(int)}
    return replace(attribution, seconds_N=seconds_N + attribution.seconds_N, **icp)


class ChargedValues(ScoringExplainer):
    """Base of explainers that are charged with the conditions of a design that they need."""

    def __init__(self, values: Values, conditions: list[int] | None, source: str, seed: int) -> None:
        self._values, self._conditions = values, conditions

    def explain(self, registrations: Registrations) -> Attribution:
        """Score by the values; equal scores name no concept."""
        attribution = charged(super().explain(registrations), registrations, self._conditions)
        return replace(attribution, abstained_N=np.ptp(attribution.scores_N_C, axis=1) == 0)

    def remedy_values(self, registrations: Registrations, worth: str) -> np.ndarray:
        """Return the values (S, 3) by the drops of a worth; corner b of the first 8 has remedy i where b has bit i."""
        return self._values(-attached(registrations, worth)[:, :8])


class KnobValues(ChargedValues):
    """The knob with the largest value of the uncertainty names the concept; nothing is learned."""

    def scores(self, registrations: Registrations) -> np.ndarray:
        return self._values(attached(registrations, "uncertainty"))


class ScaledValues(ChargedValues):
    """The remedy with the largest standardized drop of the worth names the concept; no labels are used."""

    def __init__(
        self, values: Values, conditions: list[int], source: str, seed: int, worth: Worth = "uncertainty"
    ) -> None:
        super().__init__(values, conditions, source, seed)
        self._worth = worth

    def fit(self, registrations: Registrations) -> None:
        values_N_3 = self.remedy_values(registrations, self._worth)
        self._mean_3, self._deviation_3 = values_N_3.mean(axis=0), np.maximum(values_N_3.std(axis=0), 1e-9)

    def scores(self, registrations: Registrations) -> np.ndarray:
        return (self.remedy_values(registrations, self._worth) - self._mean_3) / self._deviation_3


class LearnedValues(ChargedValues, ClassifierExplainer):
    """Logistic regression on the values of the remedies by both worths, with the same labels as GP-CA."""

    def __init__(
        self, values: Values, conditions: list[int], source: str, seed: int, inverse_regularisation: Positive = 1.0
    ) -> None:
        ChargedValues.__init__(self, values, conditions, source, seed)
        ClassifierExplainer.__init__(self, standardized_regression(inverse_regularisation))

    def features(self, registrations: Registrations) -> np.ndarray:
        return np.hstack([self.remedy_values(registrations, worth) for worth in WORTHS])


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
        errors_N_8, alarm_N = self._errors_and_alarm(registrations)
        nominal_N = registrations.concept == NOMINAL
        scatter_N_3 = self._values(errors_N_8[nominal_N] if nominal_N.any() else errors_N_8)
        self._mean_3, self._deviation_3 = scatter_N_3.mean(axis=0), np.maximum(scatter_N_3.std(axis=0), SMALLEST)
        self._threshold = NominalThreshold().fit(alarm_N, registrations.concept)

    def scores(self, registrations: Registrations) -> np.ndarray:
        from scipy.special import softmax

        errors_N_8, alarm_N = self._errors_and_alarm(registrations)
        shares_N_3 = softmax((self._values(errors_N_8) - self._mean_3) / self._deviation_3, axis=1)
        return self._threshold.scores(alarm_N, shares_N_3)

    def _errors_and_alarm(self, registrations: Registrations) -> tuple[np.ndarray, np.ndarray]:
        errors_N_8 = attached(registrations, "remedied")[:, : len(SUBSETS)]
        return errors_N_8, np.log(np.maximum(errors_N_8[:, ALL], SMALLEST))
