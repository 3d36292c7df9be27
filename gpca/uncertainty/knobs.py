"""Perturbations as knobs on top of a pair: noise level, spread of the initial pose, overlap cut (Qin et al. 2024).

The registration's uncertainty is a function f(noise, spread, overlap) of the knobs; SHAP and sensitivity analysis
explain that function. Jitter, direction of the cut and starts are drawn once per pair, so that two settings of the
knobs differ by the knobs alone.
"""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.rigid import random_direction
from gpca.errors import InputError
from gpca.pairs.perturbation import within_half_space
from gpca.uncertainty.settings import UncertaintySettings
from gpca.uncertainty.spread import Runs, Spread, run_from_starts, summarize_runs


class Knobs(NamedTuple):
    """Setting of the three features, in the order of the concepts noise, pose, overlap.

    Attributes:
        noise: standard deviation of the jitter added to the source, relative to the diameter.
        spread: factor on the spread of the initial poses.
        overlap: share of the source's points that is cut off.
    """

    noise: float = 0.0
    spread: float = 1.0
    overlap: float = 0.0


UNTOUCHED = Knobs()
# The middle of the severities: 2 % noise; starts 37.5° and 19 % of the diameter off, not 10° and 5 %; 40 % cut off.
MIDDLE = Knobs(0.02, 3.75, 0.40)
UPPER = Knobs(0.03, 6.0, 0.60)  # their upper ends: 3 %, 60°, 60 %
MOST = Knobs(1.0, 100.0, 0.95)
FEWEST_POINTS = 3  # that a cut leaves


class KnobbedSource:
    """A source cloud under any setting of noise and overlap.

    Args:
        source: (N, 3), in diameters.
        random: draws the jitter and the direction of the cut.
    """

    def __init__(self, source: np.ndarray, random: np.random.Generator) -> None:
        self._source = source
        self._jitter = random.normal(size=source.shape)
        self._along = source @ random_direction(random)

    def at(self, knobs: Knobs) -> np.ndarray:
        """Return the points (n, 3) that are left, with their jitter.

        Raises:
            InputError: a knob outside its range.
        """
        for name, value, most in zip(Knobs._fields, knobs, MOST, strict=True):
            if not 0 <= value <= most:
                raise InputError(f"knob '{name}'", f"{value} is outside [0, {most}]", "give a value within it")
        kept = within_half_space(self._along, knobs.overlap, FEWEST_POINTS)
        return (self._source + knobs.noise * self._jitter)[kept]


class KnobRuns:
    """The function f of one pair; a setting that was evaluated is not evaluated again.

    Args:
        source: (N, 3), in its own frame. target: (Q, 3). Relative to the diameter.
        T_target_source_init: initial pose. T_ref: pose from which the spread is measured.
        xi_n_6: twists of the starts.
    """

    def __init__(
        self,
        source: np.ndarray,
        target: np.ndarray,
        T_target_source_init: np.ndarray,
        T_ref: np.ndarray,
        xi_n_6: np.ndarray,
        settings: UncertaintySettings,
        random: np.random.Generator,
    ) -> None:
        self._xi_n_6 = xi_n_6
        self._source = KnobbedSource(source, random)
        self._target = target
        self._T_init = T_target_source_init
        self.T_ref = T_ref
        self._settings = settings
        self._icp = BatchedICP(target, settings.icp)
        self._seen: dict[Knobs, Spread] = {}

    def __call__(self, knobs: Knobs) -> Spread:
        """Evaluate one setting; the outcome of one seen before costs nothing.

        Raises:
            InputError: a knob outside its range.
        """
        if knobs in self._seen:
            return replace(self._seen[knobs], icp_calls=0, icp_seconds=0.0, seconds=0.0)
        self._seen[knobs] = self._evaluate(knobs)
        return self._seen[knobs]

    def _evaluate(self, knobs: Knobs) -> Spread:
        started = perf_counter()
        runs, source = self.runs(knobs)
        return summarize_runs(runs, cKDTree(source), self._target, self.T_ref, self._settings, started)

    def runs(self, knobs: Knobs) -> tuple[Runs, np.ndarray]:
        """Run ICP from all starts under one setting, seen before or not; return the runs and the source (N, 3).

        Raises:
            InputError: a knob outside its range.
        """
        source = self._source.at(knobs)
        return run_from_starts(self._icp, source, self._T_init, knobs.spread * self._xi_n_6), source
