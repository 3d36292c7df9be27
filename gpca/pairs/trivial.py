"""Ten trivial numbers of a registration, which say nothing of where the clouds differ (docs/baselines.md)."""

from __future__ import annotations

import numpy as np

from gpca.pairs.dataset import Registrations
from gpca.rigid import inverse, transform

TRIVIAL = (
    *("turn", "shift", "log_observed_extent", "log_model_extent", "log_observed_spacing", "log_model_spacing"),
    *("log_observed_points", "log_model_points", "fitness", "log_inlier_rmse"),
)
SMALLEST = 1e-5  # diameters; smaller lengths are rounding


def trivial_numbers(
    observed_P_3: np.ndarray, model_Q_3: np.ndarray, T_init: np.ndarray, fitness: float, inlier_rmse: float
) -> np.ndarray:
    """Return `TRIVIAL` of a pair after ICP, in diameters; `T_init` takes what was observed back to where ICP began."""
    from scipy.spatial import cKDTree

    clouds, center = (observed_P_3, model_Q_3), observed_P_3.mean(axis=0)
    extents = [np.sqrt(np.square(points - points.mean(axis=0)).sum(axis=1).mean()) for points in clouds]
    spacings = [np.median(cKDTree(points).query(points, 2)[0][:, 1]) for points in clouds]
    turn = np.arccos(np.clip((np.trace(T_init[:3, :3]) - 1) / 2, -1, 1))
    shift = np.sqrt(np.square(transform(T_init, center) - center).sum())
    logs = np.log(np.maximum([*extents, *spacings, *map(len, clouds), inlier_rmse], SMALLEST))
    return np.array([turn, shift, *logs[:6], fitness, logs[6]])


def trivial_numbers_of(registrations: Registrations) -> np.ndarray:
    rows = []
    for row in range(len(registrations)):
        observed, model = (cloud.astype(np.float64) for cloud in (registrations.cloud(row), registrations.target(row)))
        T_init = registrations.T_target_source("init", row) @ inverse(registrations.T_target_source("icp", row))
        fit = registrations.fitness[row], registrations.inlier_rmse[row]
        rows.append(trivial_numbers(observed, model, T_init, *fit))
    return np.array(rows).reshape(-1, len(TRIVIAL))
