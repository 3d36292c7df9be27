"""The part common to SHAP and sensitivity analysis: it turns values per concept and registration into an attribution.

Values of knobs are taken as they are. A remedy may lower the uncertainty of every pair a little, so without labels its
values are counted from their mean over the training split, in standard deviations; with labels a classifier reads them.
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Literal, get_args

import numpy as np

from gpca.attribution.scores import Attribution
from gpca.errors import InputError
from gpca.explainers.concept_classifier import ClassifierExplainer, standardized_regression
from gpca.explainers.interface import ScoringExplainer, attached
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.settings import Positive

Worth = Literal["uncertainty", "residual"]  # of a condition: KL in nats, or log distance from target to source
WORTHS: tuple[str, ...] = get_args(Worth)


class ChargedValues(ScoringExplainer):
    """The base of these explainers, which charges the conditions that they need; None stands for all."""

    def __init__(self, conditions: list[int] | None) -> None:
        self._conditions = conditions

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration by its values."""
        started = perf_counter()
        scores_N_3 = self.scores(registrations)
        return charged(registrations, scores_N_3, self._conditions, started)


class KnobValues(ChargedValues):
    """The knob with the largest value names the concept; nothing is learned.

    Args:
        values: uncertainty (S, K) under the conditions of a design -> the values (S, 3) of the knobs.
        conditions: those that it needs, and is charged with; None for all.
        source, seed: not used; nothing is drawn.
    """

    def __init__(
        self, values: Callable[[np.ndarray], np.ndarray], conditions: list[int] | None, source: str, seed: int
    ) -> None:
        super().__init__(conditions)
        self._values = values

    def fit(self, registrations: Registrations) -> None:
        """Do nothing, since nothing is learned."""

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the values of the uncertainty."""
        return self._values(attached(registrations, "uncertainty"))


class ScaledValues(ChargedValues):
    """The remedy with the largest scaled value names the concept; no labels are used.

    Args:
        values: worth (S, 8) of the corners of design ``removal`` -> the values (S, 3) of the remedies.
        conditions: the corners that it needs, and is charged with.
        source, seed: not used; nothing is drawn.
        worth: of both, a drop is counted.
    """

    def __init__(
        self,
        values: Callable[[np.ndarray], np.ndarray],
        conditions: list[int],
        source: str,
        seed: int,
        worth: Worth = "uncertainty",
    ) -> None:
        if worth not in WORTHS:
            raise InputError("setting 'worth'", f"unknown '{worth}'", f"choose one of {', '.join(WORTHS)}")
        super().__init__(conditions)
        self._values = values
        self._worth = worth

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
        values: Callable[[np.ndarray], np.ndarray],
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


def charged(
    registrations: Registrations, scores_N_3: np.ndarray, conditions: list[int] | None, started: float
) -> Attribution:
    """Make an attribution charged with these conditions, None for all, and with the time since `started`.

    Where all three scores are equal, no concept is named.
    """
    own_seconds = (perf_counter() - started) / len(registrations)
    cost = {
        name: attached(registrations, name)[:, slice(None) if conditions is None else conditions].sum(axis=1)
        for name in ("seconds", "icp_seconds", "icp_calls")
    }
    return Attribution.of_scores(
        CONCEPTS,
        scores_N_3,
        seconds=cost["seconds"] + own_seconds,
        icp_seconds=cost["icp_seconds"],
        icp_calls=cost["icp_calls"],
        abstained_N=np.ptp(scores_N_3, axis=1) == 0,
    )
