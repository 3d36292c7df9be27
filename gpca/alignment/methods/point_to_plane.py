"""Point-to-plane ICP (Chen & Medioni 1992) by Open3D, plain and with its robust kernels.

A kernel weighs a correspondence by its residual r, so that outliers count less: Huber min(1, k/r), Cauchy
1/(1 + (r/k)²), Geman-McClure 1/(1 + (r/k)²)², Tukey (1 - (r/k)²)² up to k and nothing beyond.
"""

from __future__ import annotations

from functools import partial
from typing import Literal

from gpca.alignment.methods.interface import (
    CORRESPONDENCE_DISTANCE,
    MAX_ITERATIONS,
    MethodEntry,
    Outcome,
    Pair,
    align_by_open3d,
)
from gpca.process.environment import require_open3d

Kernel = Literal["HuberLoss", "CauchyLoss", "GMLoss", "TukeyLoss"]
# Diameters. At 0.02, the middle of the protocol's noise, a poor start makes most points outliers: on a development
# seed, Tukey aligned half of the pairs with a pose error, and nearly all at 0.05.
SCALE = 0.05


def align(
    pair: Pair, correspondence_distance: float = CORRESPONDENCE_DISTANCE, max_iterations: int = MAX_ITERATIONS
) -> Outcome:
    """Minimize the distances to the planes of the target's normals."""
    return align_by_open3d(pair, "point_to_plane", correspondence_distance, max_iterations)


def align_robust(
    pair: Pair,
    kernel: Kernel,
    scale: float = SCALE,
    correspondence_distance: float = CORRESPONDENCE_DISTANCE,
    max_iterations: int = MAX_ITERATIONS,
) -> Outcome:
    """Minimize one of Open3D's robust kernels of these distances; `scale` is k, in diameters.

    Open3D's Geman-McClure takes its square.
    """
    constant = scale**2 if kernel == "GMLoss" else scale
    loss = getattr(require_open3d().pipelines.registration, kernel)(constant)
    return align_by_open3d(pair, "point_to_plane", correspondence_distance, max_iterations, loss)


METHODS = {
    "point_to_plane": MethodEntry("ICP, point-to-plane", align),
    "huber": MethodEntry("ICP, point-to-plane, Huber", partial(align_robust, kernel="HuberLoss")),
    "cauchy": MethodEntry("ICP, point-to-plane, Cauchy", partial(align_robust, kernel="CauchyLoss")),
    "geman_mcclure": MethodEntry("ICP, point-to-plane, Geman-McClure", partial(align_robust, kernel="GMLoss")),
    "tukey": MethodEntry("ICP, point-to-plane, Tukey", partial(align_robust, kernel="TukeyLoss")),
}
