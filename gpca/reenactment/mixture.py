"""The likelihood of a pose: points are normal around the model's, or outliers (Granger & Pennec 2002)."""

from dataclasses import dataclass

import numpy as np

from gpca.reenactment.mixture_kernels import FIRST_WIDTH, densities_among, fit_all

LEVELS = 9  # of widths at which the densities of the observed points are known, each √½ of the last
CELL = 0.15  # diameters; edge of the cubes that the model's points are sorted into


@dataclass(frozen=True)
class Anchor:
    """A normal prior of a pose around the identity, per axis, held by six points that stay, times `strength`."""

    rotation_rad: float
    translation: float
    strength: float = 1.0

    @property
    def arm(self) -> float:
        """How far the points ±a e lie from the origin: Σ|ω × p|² = 4 a² |ω|², and Σ|t|² = 6 |t|²."""
        return float(np.sqrt(1.5) * self.translation / self.rotation_rad)


@dataclass(frozen=True)
class Fits:
    """What the mixture says of n poses of the observed points (N, 3)."""

    T_n: np.ndarray  # (n, 4, 4), takes what was observed to the model
    log_likelihood_n: np.ndarray  # mean over the points, nats
    width_n: np.ndarray  # of the normals, standard deviation per axis
    outliers_n: np.ndarray  # share
    inlier_n_N: np.ndarray  # probability of each point to lie on the model's surface,
    lone_n_N: np.ndarray  # and on surface that the model lacks


class Mixture:
    """The mixture around a model's points (M, 3); `least_width` is the smallest that the normals may have."""

    def __init__(self, points: np.ndarray, least_width: float) -> None:
        self._low = points.min(axis=0).astype(np.float64)
        cell_M_3 = np.floor((points - self._low) / CELL).astype(np.int64)
        self._cells = cell_M_3.max(axis=0) + 1
        cell_M = np.ravel_multi_index(tuple(cell_M_3.T), tuple(self._cells))
        order_M = np.argsort(cell_M, kind="stable")
        self._points_3_M = np.ascontiguousarray(points[order_M].T, np.float64)
        self._starts = np.searchsorted(cell_M[order_M], np.arange(np.prod(self._cells) + 1))
        self._least = least_width**2

    def fit(
        self,
        observed: np.ndarray,
        T_n: np.ndarray,
        iterations: int,
        moving: bool = True,
        anchor: Anchor | None = None,
        width_n: np.ndarray | None = None,
        densities: np.ndarray | None = None,
    ) -> Fits:
        """Maximize the likelihood of the observed points (N, 3) from each pose (n, 4, 4), times that of an anchor.

        Where poses are not moving, width and share of outliers alone are estimated. The normals are `width_n` wide at
        first. With the densities of the observed points (:func:`densities_of`), the model may lack surface.
        """
        poses_n, n = np.array(T_n, np.float64), len(T_n)
        likelihood_n, outliers_n = np.empty((2, n))
        width_n = np.full(n, FIRST_WIDTH) if width_n is None else width_n
        variance_n = np.maximum(np.square(width_n, dtype=np.float64), self._least)
        inlier_n_N, lone_n_N = np.empty((2, n, len(observed)))
        precision, arm = (anchor.strength / anchor.translation**2, anchor.arm) if anchor else (0.0, 0.0)
        fit_all(
            *(np.ascontiguousarray(observed, np.float64), poses_n, iterations, moving, precision, arm, self._least),
            *(self._points_3_M, self._starts, self._low, CELL, self._cells),
            np.empty((0, len(observed))) if densities is None else densities,
            *(likelihood_n, variance_n, outliers_n, inlier_n_N, lone_n_N),
        )
        return Fits(poses_n, likelihood_n, np.sqrt(variance_n), outliers_n, inlier_n_N, lone_n_N)


def densities_of(observed: np.ndarray, model: np.ndarray) -> np.ndarray:
    """Return how dense (LEVELS, N) surface that the model (M, 3) lacks is at observed points."""
    density_L_N, typical = (np.zeros((LEVELS, len(points))) for points in (observed, model))
    for points, densities in ((observed, density_L_N), (model, typical)):
        densities_among(np.ascontiguousarray(points, np.float64), densities)
    return density_L_N * np.minimum(1.0, typical.mean(axis=1) / np.maximum(density_L_N.mean(axis=1), 1e-9))[:, None]
