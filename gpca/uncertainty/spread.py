"""How uncertain a registration is: the spread of ICP's results over initial poses (Qin et al. 2024).

ICP runs from n starts T₀ = exp(ξ) T_init with ξ ~ N(0, diag(σ_rot², σ_t²)). The twists e = log(T T_ref⁻¹) of the
results have the covariance Σ, and the uncertainty is the divergence from that of a clean run of the same pair,
u = KL(N(0, Σ_clean + εI) ‖ N(0, Σ + εI)). Lengths are relative to the object's diameter throughout.
"""

from dataclasses import dataclass, replace
from time import perf_counter
from typing import Self

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import AnyICP
from gpca.alignment.icp import clipped_cost
from gpca.rigid import exp, inverse, log, transform
from gpca.uncertainty.settings import UncertaintySettings

SMALLEST_RESIDUAL = 1e-6  # diameters; a cloud on itself counts as this far off, or the logarithm would be infinite


@dataclass(frozen=True)
class Runs:
    """The results of ICP from n starts: poses (n, 4, 4), fitness and inlier RMSE (n,), number and seconds of runs."""

    T_target_source_n: np.ndarray
    fitness_n: np.ndarray
    inlier_rmse_n: np.ndarray
    icp_calls: int
    icp_seconds: float

    def cost_n(self, distance: float) -> np.ndarray:
        """Return the source's mean squared distance to the target, cut off at the correspondence distance."""
        return clipped_cost(self.fitness_n, self.inlier_rmse_n, distance)

    def chosen(self, rows_n: np.ndarray) -> Self:
        """Return these runs' results at the given rows, which may repeat."""
        names = ("T_target_source_n", "fitness_n", "inlier_rmse_n")
        return replace(self, **{name: getattr(self, name)[rows_n] for name in names})

    def covariance(self, T_ref: np.ndarray) -> np.ndarray:
        """Return Σ (6, 6) of e = log(T T_ref⁻¹), radians and diameters."""
        return np.cov(log(self.T_target_source_n @ inverse(T_ref)), rowvar=False)

    def degenerate(self, floor: float) -> bool:
        """Whether the covariance says nothing: no run found a correspondence, or all ended at the same pose."""
        variance_3_4 = self.T_target_source_n[:, :3].var(axis=0)
        # To first order a rotation's entries vary twice as much as its vector.
        spread = variance_3_4[:, :3].sum() / 2 + variance_3_4[:, 3].sum()
        return not self.fitness_n.any() or bool(spread < 6 * floor)


def run_from_starts(icp: AnyICP, source: np.ndarray, T_target_source_init: np.ndarray, xi_n_6: np.ndarray) -> Runs:
    """Run ICP from the starts exp(ξ) T_init."""
    starts_n = exp(xi_n_6) @ T_target_source_init
    started = perf_counter()
    poses_n, fitness_n, rmse_n = icp.register(source, starts_n)
    return Runs(poses_n, fitness_n, rmse_n, len(poses_n), perf_counter() - started)


@dataclass(frozen=True)
class Spread:
    """The summary of one condition, e.g. one setting of the knobs."""

    covariance: np.ndarray  # Σ (6, 6)
    residual: float  # log of the RMS distance from the target's points to the source at the best run's pose
    degenerate: bool  # whether the covariance says nothing (:meth:`Runs.degenerate`)
    icp_calls: int
    icp_seconds: float
    seconds: float


def summarize_runs(
    runs: Runs,
    source_tree: cKDTree,
    target: np.ndarray,
    T_ref: np.ndarray,
    settings: UncertaintySettings,
    started: float,
) -> Spread:
    """Summarize the runs of one condition, whose work began at `started`; the residual is that of `target` (Q, 3)."""
    best = runs.T_target_source_n[runs.cost_n(settings.icp.correspondence_distance).argmin()]
    return Spread(
        covariance=runs.covariance(T_ref),
        residual=log_residual(transform(inverse(best), target), source_tree),
        degenerate=runs.degenerate(settings.floor),
        icp_calls=runs.icp_calls,
        icp_seconds=runs.icp_seconds,
        seconds=perf_counter() - started,
    )


def log_residual(points: np.ndarray, tree: cKDTree) -> float:
    """Return the log of the root mean square distance from each point (N, 3) to the nearest of the tree's."""
    distances_N, _ = tree.query(points)
    return float(np.log(max(np.sqrt(np.mean(distances_N**2)), SMALLEST_RESIDUAL)))


def divergence(covariance_clean: np.ndarray, covariance: np.ndarray, floor: float) -> np.ndarray:
    """Return u = KL(N(0, Σ_clean + εI) ‖ N(0, Σ + εI)) in nats over the last two axes (…, k, k), k = 6 for a pose.

    u = ½ [tr(Σ⁻¹ Σ_clean) + ln(|Σ| / |Σ_clean|) − k]; zero where the two are equal, finite whatever they are.
    """
    k = covariance.shape[-1]
    clean, other = covariance_clean + floor * np.eye(k), covariance + floor * np.eye(k)
    trace = np.trace(np.linalg.solve(other, np.broadcast_to(clean, other.shape)), axis1=-2, axis2=-1)
    log_ratio = np.linalg.slogdet(other)[1] - np.linalg.slogdet(clean)[1]
    return np.maximum(0.5 * (trace + log_ratio - k), 0.0)


def log_determinant(covariance: np.ndarray, floor: float) -> np.ndarray:
    """Return ln |Σ + εI| over the last two axes, an uncertainty that needs no clean run."""
    return np.linalg.slogdet(covariance + floor * np.eye(6))[1]
