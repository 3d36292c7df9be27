"""The motion of ICP: how far it moved the cloud, how well the cloud then fits, and where other starts end."""

from __future__ import annotations

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.alignment.pose_error import displacements
from gpca.alignment.rigid import inverse
from gpca.alignment.twist import log
from gpca.features.pair import ObservedPair

FLOOR = 1e-4  # of the spread's variances, as in the truth (docs/causes.md)
SMALLEST_COST = 1e-9  # squared diameters
QUARTERS = (0.25, 0.5, 0.75, 1.0)
ENDS = (0.0, 0.5, 1.0)
STARTS = (
    *("cost", "best_cost", "gain", "log_gain", "to_best", "mean_displacement"),
    *(f"displacement_{quantile:g}" for quantile in QUARTERS),
    "cost_deviation",
    *(f"fitness_{quantile:g}" for quantile in ENDS),
    *(f"inlier_rmse_{quantile:g}" for quantile in ENDS),
)


def describe_motion(pair: ObservedPair) -> np.ndarray:
    """Return the numbers of :data:`gpca.features.settings.MOTION`, in radians and diameters.

    Angle, length and displacement from the initial pose; the fit; and the spread of the runs from other starts.
    """
    moved = log(inverse(pair.T_init)[None])[0]
    covariance = np.cov(log(pair.T_runs), rowvar=False)
    variance_6 = np.diag(covariance)
    return np.array(
        [
            np.sqrt(np.square(moved[:3]).sum()),
            np.sqrt(np.square(moved[3:]).sum()),
            displacements(pair.T_init[None], pair.observed)[0],
            pair.fitness_n[0],
            pair.inlier_rmse_n[0],
            np.sqrt(variance_6[:3].sum()),
            np.sqrt(variance_6[3:].sum()),
            np.linalg.slogdet(covariance + FLOOR * np.eye(6))[1],
        ]
    )


def describe_starts(pair: ObservedPair, icp: ICPSettings) -> np.ndarray:
    """Return `STARTS`: whether another start ends elsewhere, and fits better there."""
    cost_n = pair.cost_n(icp)
    best = cost_n.argmin()
    moved_n = displacements(pair.T_runs, pair.observed)
    return np.array(
        [
            cost_n[0],
            cost_n[best],
            cost_n[0] - cost_n[best],
            np.log(max(cost_n[0], SMALLEST_COST) / max(cost_n[best], SMALLEST_COST)),
            moved_n[best],
            moved_n.mean(),
            *np.quantile(moved_n, QUARTERS),
            cost_n.std(),
            *np.quantile(pair.fitness_n, ENDS),
            *np.quantile(pair.inlier_rmse_n, ENDS),
        ]
    )
