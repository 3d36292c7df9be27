"""An estimator of the covariance of a pose."""

from __future__ import annotations

import numpy as np

from gpca.uncertainty.estimators.interface import EstimatorEntry, RegisteredPair


def residual_covariance(registered: RegisteredPair, floor: float = 1e-6) -> np.ndarray:
    """Return the variance of the residuals in every direction (6, 6), as if rotation and translation were alike."""
    return (registered.matches().variance + floor) * np.eye(6)


ESTIMATORS = {"my_residuals": EstimatorEntry("Residual variance (mine)", "data", residual_covariance)}
