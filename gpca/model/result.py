"""The probability that a pose is off by more than any tolerance, by a re-enactment's hypotheses of the true pose."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import pi, radians, sin
from operator import attrgetter

import numpy as np
from scipy.special import expit, logit

from gpca.causes.truth import LARGEST_ERROR
from gpca.errors import InputError
from gpca.explainers.classifiers import BoostedQuestion, standardized_regression
from gpca.guarantee.guarantee import Guarantee
from gpca.io.container import Container, array
from gpca.numerals import decimal
from gpca.objects.surface import METERS_PER_UNIT
from gpca.reenactment.settings import STEEPNESS

TOLERANCES = (0.01, 0.02, 0.03, 0.05, 0.1)  # diameters, at which it is trained and calibrated
DEFAULT_TOLERANCE = 0.03
SMALLEST = 1e-3  # diameters; the spacing of the points hides smaller distances
SUREST = 0.998  # largest weight of poses apart from the result: other poses than the hypotheses are possible
EVEN = 0.5  # threshold of a judge without calibration
# Rows of weights; the last number of each is the constant.
PROBABILITY = ("apart", "mean_distance", "first_distance", "inlier_rmse", "fitness", "tolerance")
ERROR = PROBABILITY[1:5]
OF_TREES = {"log_odds": 1, "log_tolerance": -1}  # what trees read before the descriptors; the probability rises, falls
ROUNDED = 1 + 1e-9  # a tolerance may have been a length
REGULARIZATION = 0.3  # scikit-learn's C, on standardized numbers
SHARE, ANGLE = "%", "deg"  # units of a tolerance beside lengths
LARGEST_TOLERANCE = 0.5  # of the target's diameter; beyond, no pose would be wrong
TOLERANCE_REMEDY = f"give a length, an angle or a share of the diameter, such as 5mm, 2{ANGLE} or 3{SHARE}"


@dataclass(frozen=True)
class Tolerance:
    """How far a pose may be off: a value with `SHARE`, `ANGLE` or a unit of length."""

    value: float
    unit: str

    @classmethod
    def parse(cls, text: str) -> Tolerance:
        """Read a text such as ``5mm``, ``2deg`` or ``3%``; an InputError for any other."""
        units = "|".join((SHARE, ANGLE, *METERS_PER_UNIT))
        match = re.fullmatch(rf"(.+?) ?({units})", text.strip())
        with suppress(ValueError):
            if match and (value := decimal(match[1])) > 0:
                return cls(value, match[2])
        raise InputError(f"tolerance '{text}'", "is not positive, or has no unit", TOLERANCE_REMEDY)

    def length(self, target: np.ndarray, diameter: float, unit: str) -> float:
        """Return the distance it allows a point of a target (M, 3) in diameters; of an angle, the mean by a turn."""
        if self.unit == SHARE:
            length = self.value / 100 * diameter
        elif self.unit == ANGLE:
            # A point at the distance d from the center is on average π/4 · d from an axis through the center.
            arm = pi / 4 * float(np.linalg.norm(target, axis=1).mean()) * diameter
            length = 2 * sin(radians(min(self.value, 180.0)) / 2) * arm
        else:
            length = self.value * METERS_PER_UNIT[self.unit] / METERS_PER_UNIT[unit]
        if not length <= LARGEST_TOLERANCE * diameter:
            fault = f"is {length / diameter:.3g} diameters of the target"
            raise InputError(f"tolerance {self}", fault, f"give at most half of the diameter, {diameter:.4g} {unit}")
        return length

    def __str__(self) -> str:
        return f"{self.value:g}{self.unit}" if self.unit == SHARE else f"{self.value:g} {self.unit}"


DEFAULT = Tolerance(100 * DEFAULT_TOLERANCE, SHARE)


@dataclass(frozen=True)
class Evidence(Container):
    """What is read of N poses, under K hypotheses of the true one each."""

    distance_N_K: np.ndarray = array("N K")  # error of the pose if the hypothesis is true, diameters
    weight_N_K: np.ndarray = array("N K")  # probabilities of the hypotheses
    inlier_rmse_N: np.ndarray = array("N")  # diameters
    fitness_N: np.ndarray = array("N")

    def apart(self, tolerance: float) -> np.ndarray:
        """Return the weight (N,) of hypotheses that lie farther than the tolerance from the pose."""
        off_N_K = expit(STEEPNESS * np.log(np.maximum(self.distance_N_K, SMALLEST) / tolerance))
        return (self.weight_N_K * off_N_K).sum(axis=1)

    def numbers(self, tolerance: float) -> np.ndarray:
        """Return `PROBABILITY` (N, 6); lengths are logarithms relative to the tolerance."""
        mean_N = (self.weight_N_K * self.distance_N_K).sum(axis=1)
        lengths = (np.maximum(x_N, SMALLEST) for x_N in (mean_N, self.distance_N_K[:, 0], self.inlier_rmse_N))
        apart_N = logit(np.clip(self.apart(tolerance), 1 - SUREST, SUREST))
        constant_N = np.full(len(mean_N), np.log(tolerance))
        relative = [np.log(length_N / tolerance) for length_N in lengths]
        return np.column_stack([apart_N, *relative, self.fitness_N, constant_N])


@dataclass(frozen=True)
class ResultJudge:
    """Judges poses by what a re-enactment says of them."""

    weights: np.ndarray  # (7,) of `PROBABILITY` in log odds, the constant last
    error_weights: np.ndarray  # (5,) of `ERROR` in ln error (diameters), the constant last
    trees: BoostedQuestion | None = None  # on `OF_TREES` and descriptors of registrations

    @classmethod
    def untrained(cls) -> ResultJudge:
        """Return a judge that says the weight of hypotheses apart from the pose, and the mean distance to them."""
        return cls(np.eye(7)[0], np.eye(5)[0])

    @classmethod
    def fit(cls, evidence: Evidence, error_N: np.ndarray, described_N_F: np.ndarray | None = None) -> ResultJudge:
        """Learn from poses with known errors (diameters) and, of registrations, descriptors, at all `TOLERANCES`."""
        from sklearn.linear_model import Ridge

        numbers = np.concatenate([evidence.numbers(tolerance) for tolerance in TOLERANCES])
        off = np.concatenate([error_N > tolerance for tolerance in TOLERANCES])
        if off.all() or not off.any():
            return cls.untrained()
        scaler, regression = standardized_regression(REGULARIZATION).fit(numbers, off)
        slopes = regression.coef_[0] / scaler.scale_
        weights = np.append(slopes, regression.intercept_ - slopes @ scaler.mean_)
        error = Ridge(alpha=1.0).fit(evidence.numbers(1.0)[:, 1:5], np.log(np.maximum(error_N, SMALLEST)))
        judge = cls(weights, np.append(error.coef_, error.intercept_))
        if described_N_F is None:
            return judge
        inputs = [judge._inputs(judge._log_odds(evidence, each), each, described_N_F) for each in TOLERANCES]
        signs = [*OF_TREES.values(), *[0] * described_N_F.shape[1]]
        return replace(judge, trees=BoostedQuestion.fit(np.concatenate(inputs), off, "result", monotonic=signs))

    def probability(self, evidence: Evidence, tolerance: float, described_N_F: np.ndarray | None = None) -> np.ndarray:
        """Return the probabilities (N,) of poses to be off by more than the tolerance; descriptors if registered."""
        log_odds_N = self._log_odds(evidence, tolerance)
        if self.trees is not None and described_N_F is not None:
            log_odds_N = (log_odds_N + self.trees.log_odds(self._inputs(log_odds_N, tolerance, described_N_F))) / 2
        return expit(log_odds_N)

    def _log_odds(self, evidence: Evidence, tolerance: float) -> np.ndarray:
        return evidence.numbers(tolerance) @ self.weights[:-1] + self.weights[-1]

    @staticmethod
    def _inputs(log_odds_N: np.ndarray, tolerance: float, described_N_F: np.ndarray) -> np.ndarray:
        tolerance_N = np.full(len(log_odds_N), np.log(tolerance))
        return np.column_stack([log_odds_N, tolerance_N, np.nan_to_num(described_N_F)])

    def state(self) -> dict[str, object]:
        """Return arrays and trees for :meth:`from_state`."""
        trees = {"trees": vars(self.trees)} if self.trees else {}
        return {"weights": self.weights, "error_weights": self.error_weights, **trees}

    @classmethod
    def from_state(cls, state: Mapping) -> ResultJudge:
        """Return the judge of a :meth:`state`; before there were trees, it had none."""
        trees = state.get("trees")
        return cls(state["weights"], state["error_weights"], trees and BoostedQuestion(**trees))

    def error(self, evidence: Evidence) -> np.ndarray:
        """Return the expected errors (N,), diameters."""
        log_N = evidence.numbers(1.0)[:, 1:5] @ self.error_weights[:-1] + self.error_weights[-1]
        return np.exp(log_N).clip(SMALLEST, LARGEST_ERROR)


@dataclass(frozen=True)
class Calibrated:
    """What was calibrated at one tolerance on unseen families."""

    tolerance: float  # diameters
    threshold: float  # probability from which a result is called failed
    guarantee: Guarantee | None = None  # sets of states and alarm
    repaired_below: float | None = None  # probability below which a repaired pose is called so, with a promise
    held_out: Mapping[str, float] = field(default_factory=dict)  # measures of accuracy on unseen families of shapes

    @property
    def good_below(self) -> float:
        """The probability below which a pose that takes the place of another is called good."""
        bound = self.repaired_below
        if bound is None and self.guarantee is not None:
            bound = self.guarantee.failure_alarm.good_below
        return self.threshold if bound is None else min(bound, self.threshold)

    def state(self) -> dict[str, object]:
        """Return plain values for :meth:`from_state`."""
        guarantee = self.guarantee and self.guarantee.to_dict()
        return vars(self) | {"guarantee": guarantee, "held_out": dict(self.held_out)}

    @classmethod
    def from_state(cls, state: Mapping) -> Calibrated:
        """Return what :meth:`state` holds."""
        guarantee = None if state["guarantee"] is None else Guarantee.from_dict(state["guarantee"])
        return cls(**{**state, "guarantee": guarantee})


UNCALIBRATED = (Calibrated(DEFAULT_TOLERANCE, EVEN),)


def level_at(levels: Sequence[Calibrated], tolerance: float) -> Calibrated:
    """Return what holds at a tolerance: between two levels the more cautious of both, beyond them no guarantee."""
    by = attrgetter("tolerance")
    lower = max((level for level in levels if level.tolerance <= tolerance * ROUNDED), default=None, key=by)
    upper = min((level for level in levels if level.tolerance >= tolerance / ROUNDED), default=None, key=by)
    if lower is None or upper is None:
        nearest = lower or upper
        assert nearest is not None
        return Calibrated(tolerance, nearest.threshold)
    both = lower.guarantee, upper.guarantee
    cautious = both[0].more_cautious(both[1]) if both[0] and both[1] else None
    bounds = [level.repaired_below for level in (lower, upper) if level.repaired_below is not None]
    below = min(bounds) if len(bounds) == 2 else None
    return Calibrated(tolerance, max(lower.threshold, upper.threshold), cautious, below)
