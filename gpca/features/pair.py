"""One registered pair, as everything that describes it sees it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpca.alignment.icp import ICPSettings, clipped_cost
from gpca.alignment.rigid import inverse, scale_translation
from gpca.causes.dataset import Causes


@dataclass(frozen=True)
class ObservedPair:
    """The observed cloud and the model, both in the model's frame and in diameters.

    Attributes:
        observed: (N, 3) points, where ICP put them.
        model: (M, 3).
        T_init: 4×4, takes the observed cloud from where ICP put it back to where ICP started.
        T_runs: (n, 4, 4), takes it from there to what ICP found from other starts; the first is the identity.
        fitness_n, inlier_rmse_n: (n,) of these runs.
        axes: name what is random in describing it.
    """

    observed: np.ndarray
    model: np.ndarray
    T_init: np.ndarray
    T_runs: np.ndarray
    fitness_n: np.ndarray
    inlier_rmse_n: np.ndarray
    axes: tuple

    def cost_n(self, icp: ICPSettings) -> np.ndarray:
        """Return the mean squared distance of each run (n,), cut off at the correspondence distance."""
        return clipped_cost(self.fitness_n, self.inlier_rmse_n, icp.correspondence_distance)


def observed_pair(causes: Causes, row: int, *axes: object) -> ObservedPair:
    """Return what may be seen of a row; its draws are named by the axes, its split and its number."""
    registrations, diameter_m = causes.registrations, causes.registrations.diameter_m[row]
    T_back = inverse(registrations.T_target_source("icp", row))
    runs_n = [scale_translation(T, 1 / diameter_m) @ T_back for T in causes.T_target_source_runs[row]]
    return ObservedPair(
        observed=registrations.cloud(row).astype(np.float64),
        model=registrations.target(row).astype(np.float64),
        T_init=registrations.T_target_source("init", row) @ T_back,
        T_runs=np.array(runs_n),
        fitness_n=causes.fitness_runs[row],
        inlier_rmse_n=causes.inlier_rmse_runs[row],
        axes=(*axes, registrations.split[row], registrations.sample[row]),
    )
