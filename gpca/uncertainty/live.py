"""The registration's uncertainty as a live function of the knobs: whoever calls it makes ICP run.

Explainers read outcomes from a table, the designs' (:mod:`gpca.uncertainty.designs`), so that many explainers share the
runs. This is the function behind the table.
"""

from __future__ import annotations

import numpy as np

from gpca.pairs.dataset import Registrations
from gpca.uncertainty.designs import knob_runs
from gpca.uncertainty.knobs import UNTOUCHED, Knobs
from gpca.uncertainty.settings import UncertaintySettings
from gpca.uncertainty.spread import divergence


class LiveUncertainty:
    """u(noise, spread, overlap) of an observed pair in nats; nothing is kept from one call to the next.

    Its random numbers are those of the sample in design ``additive``, so it gives what the design's table holds.

    Attributes:
        icp_calls: runs of ICP so far, those of the clean run included.
    """

    def __init__(
        self, registrations: Registrations, row: int, source: str, seed: int, settings: UncertaintySettings
    ) -> None:
        self.icp_calls = 0
        self._floor = settings.floor
        self._runs = knob_runs(registrations, row, source, seed, settings)
        self._clean_6_6 = self._covariance(UNTOUCHED)

    def __call__(self, knobs: Knobs) -> float:
        """Register from all starts with the knobs as given, and return the uncertainty.

        Raises:
            InputError: a knob outside its range.
        """
        return float(divergence(self._clean_6_6, self._covariance(knobs), self._floor))

    def _covariance(self, knobs: Knobs) -> np.ndarray:
        runs, _ = self._runs.runs(knobs)
        self.icp_calls += runs.icp_calls
        return runs.covariance(self._runs.T_ref)
