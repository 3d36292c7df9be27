"""How uncertain the pose of one registration is, by any estimator that needs no training registrations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.canonical_frame import thin
from gpca.alignment.icp import Method
from gpca.alignment.methods.interface import Outcome, Pair
from gpca.model.explanation import PoseSpread
from gpca.seeds import generator, seed_of
from gpca.uncertainty.estimators.interface import Estimate, RegisteredPair
from gpca.uncertainty.estimators.registry import make_estimator
from gpca.uncertainty.settings import MONTE_CARLO, UncertaintySettings
from gpca.uncertainty.spread import run_from_starts

NAMES: dict[Method, str] = {  # of the model's kinds of ICP among the registration methods
    "point_to_point": "point_to_point",
    "point_to_plane": "point_to_plane",
    "generalized": "gicp",
}


def spread_estimator(name: str, settings: UncertaintySettings) -> Callable[[RegisteredPair], Estimate]:
    """Return the estimator of that name, Monte-Carlo with the settings' starts.

    Raises:
        InputError: an unknown name, or an estimator that learns.
    """
    return make_estimator(name, {"starts": settings.starts} if name == MONTE_CARLO else {})


def spread_of_icp(
    icp: BatchedICP, source: np.ndarray, T_icp: np.ndarray, settings: UncertaintySettings, diameter: float
) -> PoseSpread:
    """Return the spread of the model's own ICP over starts around the identity, by Monte-Carlo."""
    xi_n_6 = generator("explanation", "starts").normal(size=(settings.starts, 6)) * settings.deviation_6()
    runs = run_from_starts(icp, thin(source, settings.icp_points, "spread"), np.eye(4), xi_n_6)
    return PoseSpread(runs.covariance(T_icp), diameter, MONTE_CARLO, settings.starts)


def estimated_spread(
    estimate: Callable[[RegisteredPair], Estimate],
    name: str,
    source: np.ndarray,
    target: np.ndarray,
    outcome: Outcome,
    method: str,
    settings: UncertaintySettings,
    diameter: float,
) -> tuple[PoseSpread | None, str]:
    """Return an estimator's spread of a registration that started at the identity, or the reason why it has none.

    Args:
        name: of the estimator.
        source, target: in diameters; thinned to the settings' points.
        outcome, method: the result, and the registration method that found it.
    """
    source = thin(source, settings.icp_points, "spread")
    target = thin(target, settings.icp_points, "spread", "target")
    pair = Pair(source, target, seed=seed_of("explanation", "estimate")).with_normals()
    estimated = estimate(RegisteredPair(pair, outcome, method, settings.deviation_6()))
    if estimated.covariance_6_6 is None:
        return None, f"{name} gives no covariance: {estimated.failure}"
    return PoseSpread(estimated.covariance_6_6, diameter, name, settings.starts if name == MONTE_CARLO else None), ""
