"""The likelihood of a pose: observed points are normal around the model's points, or outliers spread over a cube.

Both the width of the normals and the share of outliers are estimated for each pose, so no normals and no noise level
are needed. Expectation maximization moves the pose as ICP does, but each point is drawn to the mean of its partners,
weighted by how probable they are (Granger & Pennec 2002; Myronenko & Song 2010).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpca.alignment.icp_kernels import move
from gpca.alignment.icp_target import Target, make_target
from gpca.causes.truth import LARGEST_ERROR
from gpca.process.compilation import njit

REACH = 14.0  # squared distance, in variances, beyond which a partner's weight of e⁻⁷ counts as none
FIRST_WIDTH, LARGEST_WIDTH = 0.03, 0.12  # diameters, standard deviation per axis
FIRST_OUTLIERS, FEWEST_OUTLIERS, MOST_OUTLIERS = 0.05, 0.01, 0.2


@dataclass(frozen=True)
class Anchor:
    """A prior of a pose: normal around the identity, of the angle (radians) and the length per axis.

    It acts as six points that stay where they are, so many that they hold the pose as firmly (:meth:`arm`). `strength`
    is a factor of its precision.
    """

    rotation_rad: float
    translation: float
    strength: float = 1.0

    @property
    def arm(self) -> float:
        """How far the points ±a e lie from the origin: Σ|ω × p|² = 4 a² |ω|², and Σ|t|² = 6 |t|²."""
        return float(np.sqrt(1.5) * self.translation / self.rotation_rad)


@dataclass(frozen=True)
class Fits:
    """What the mixture says of n poses of the observed points (N, 3).

    Attributes:
        T_n: (n, 4, 4), takes what was observed to the model.
        log_likelihood_n: (n,) mean over the points, nats.
        width_n: (n,) of the normals, standard deviation per axis.
        outliers_n: (n,) share.
        inlier_n_N: (n, N) probability of each point to be no outlier.
    """

    T_n: np.ndarray
    log_likelihood_n: np.ndarray
    width_n: np.ndarray
    outliers_n: np.ndarray
    inlier_n_N: np.ndarray


class Mixture:
    """The mixture around a model's points (M, 3); `least_width` is the smallest that the normals may have."""

    def __init__(self, points: np.ndarray, least_width: float) -> None:
        self._target: Target = make_target(points, LARGEST_ERROR)
        self._least = least_width**2

    def fit(
        self, observed: np.ndarray, T_n: np.ndarray, iterations: int, moving: bool = True, anchor: Anchor | None = None
    ) -> Fits:
        """Maximize the likelihood of the observed points (N, 3) from each pose (n, 4, 4), times that of an anchor.

        Without `moving`, the width and the share of outliers are estimated at the poses as they are.
        """
        poses_n, n = np.array(T_n, np.float64), len(T_n)
        likelihood_n, variance_n, outliers_n = np.empty(n), np.empty(n), np.empty(n)
        inlier_n_N = np.empty((n, len(observed)))
        target = self._target
        precision, arm = (anchor.strength / anchor.translation**2, anchor.arm) if anchor else (0.0, 0.0)
        _fit_all(
            *(np.ascontiguousarray(observed, np.float64), poses_n, iterations, moving, precision, arm, self._least),
            *(target.points, target.starts, target.low, target.cell, target.cells),
            *(likelihood_n, variance_n, outliers_n, inlier_n_N),
        )
        return Fits(poses_n, likelihood_n, np.sqrt(variance_n), outliers_n, inlier_n_N)


@njit(cache=True, error_model="numpy")
def _fit_all(
    observed,
    poses,
    iterations,
    moving,
    precision,
    arm,
    least,
    points,
    starts,
    low,
    cell,
    cells,
    likelihood,
    variance,
    outliers,
    inlier,
):
    moments, room = np.empty((4, 4)), np.empty((8, 4))
    count = len(observed)
    for n in range(len(poses)):
        variance[n], outliers[n] = max(least, FIRST_WIDTH**2), FIRST_OUTLIERS
        for iteration in range(iterations + 1):
            likelihood[n], weight, square = _expect(
                observed, poses[n], points, starts, low, cell, cells, variance[n], outliers[n], inlier[n], moments
            )
            if iteration == iterations:
                break
            if weight > 1e-9:
                variance[n] = min(max(square / (3 * weight), least), LARGEST_WIDTH**2)
                if moving:
                    _anchor(poses[n], moments, arm, precision * variance[n] / 6)
                    moments /= moments[3, 3]
                    move(poses[n], moments, room)
            outliers[n] = min(max(1 - weight / count, FEWEST_OUTLIERS), MOST_OUTLIERS)


@njit(cache=True, error_model="numpy")
def _expect(observed, pose, points, starts, low, cell, cells, variance, outliers, inlier, moments):
    """Fill the probability (N,) of each point to be no outlier, and Σ w [q, 1] [p, 1]ᵀ over points p and partners q.

    Returns the mean log-likelihood, Σ w, and Σ w times the mean squared distance of each point from its partners.
    """
    limit, factor = REACH * variance, 0.5 / variance
    radius = np.sqrt(limit)
    scale = (1.0 - outliers) / len(points) * (2 * np.pi * variance) ** -1.5
    total, weight, square = 0.0, 0.0, 0.0
    moments[:] = 0.0
    for i in range(len(observed)):
        x, y, z = observed[i, 0], observed[i, 1], observed[i, 2]
        px = pose[0, 0] * x + pose[0, 1] * y + pose[0, 2] * z + pose[0, 3]
        py = pose[1, 0] * x + pose[1, 1] * y + pose[1, 2] * z + pose[1, 3]
        pz = pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z + pose[2, 3]
        s, sx, sy, sz, sd = 0.0, 0.0, 0.0, 0.0, 0.0
        i_low, i_high = _cells_within(px, low[0], cell, cells[0], radius)
        j_low, j_high = _cells_within(py, low[1], cell, cells[1], radius)
        k_low, k_high = _cells_within(pz, low[2], cell, cells[2], radius)
        if k_low < k_high:
            for a in range(i_low, i_high):
                for b in range(j_low, j_high):
                    # Cells along the last axis follow each other.
                    row = (a * cells[1] + b) * cells[2]
                    for m in range(starts[row + k_low], starts[row + k_high]):
                        dx, dy, dz = px - points[m, 0], py - points[m, 1], pz - points[m, 2]
                        d = dx * dx + dy * dy + dz * dz
                        if d < limit:
                            w = np.exp(-factor * d)
                            s += w
                            sx += w * points[m, 0]
                            sy += w * points[m, 1]
                            sz += w * points[m, 2]
                            sd += w * d
        density = scale * s + outliers  # the cube of the outliers has edge 1
        total += np.log(density)
        inlier[i] = scale * s / density
        if s > 0.0:
            w = inlier[i]
            weight += w
            square += w * (sd / s)
            qx, qy, qz = w * (sx / s), w * (sy / s), w * (sz / s)
            moments[0, 0] += qx * px
            moments[0, 1] += qx * py
            moments[0, 2] += qx * pz
            moments[0, 3] += qx
            moments[1, 0] += qy * px
            moments[1, 1] += qy * py
            moments[1, 2] += qy * pz
            moments[1, 3] += qy
            moments[2, 0] += qz * px
            moments[2, 1] += qz * py
            moments[2, 2] += qz * pz
            moments[2, 3] += qz
            moments[3, 0] += w * px
            moments[3, 1] += w * py
            moments[3, 2] += w * pz
            moments[3, 3] += w
    return total / len(observed), weight, square


@njit(cache=True, error_model="numpy")
def _anchor(pose, moments, arm, weight):
    """Add six points at ±arm on the axes, which the pose has moved and which ought to stay."""
    for axis in range(3):
        for sign in (-1.0, 1.0):
            for i in range(3):
                p = pose[i, 3] + sign * arm * pose[i, axis]
                moments[axis, i] += weight * sign * arm * p
                moments[3, i] += weight * p
            moments[axis, 3] += weight * sign * arm
            moments[3, 3] += weight


@njit(cache=True, error_model="numpy")
def _cells_within(x, low, cell, cells, radius):
    first, last = int(np.floor((x - radius - low) / cell)), int(np.floor((x + radius - low) / cell))
    return max(0, first), min(cells, last + 1)
