"""A model cloud as a surface: local planes, spacing, roughness, and which part of it an observation misses."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import make_target
from gpca.causes.truth import LARGEST_ERROR
from gpca.objects.bop import find_symmetries, symmetric_turn
from gpca.pairs.distances import second_moments
from gpca.reenactment.regions import DIRECTIONS, Regions, directions
from gpca.reenactment.surface_kernels import nearest_rows, shares_within, surface_distances
from gpca.rigid import dots, rigid_motion

JUDGED = 256  # points over which an error is the mean
COMPARED = 64  # points that tell whether two poses are the same
PART, UNEVEN = 0.95, 3.0  # share of them beyond which a part lies, and how much farther it may lie than the mean
TRIMMED = 0.94  # share of the residuals that count, the smallest: outliers are at most a twentieth
LEAST_SPACING = 1e-4  # diameters; a user's cloud may hold every point twice
# A turn is a symmetry if the mean distance from the surface is at most SYMMETRIC + SPARSE · spacing + NOISY · noise.
SYMMETRIC, SPARSE, NOISY = 0.012, 0.25, 0.2
# A part beyond this share of them, such as a handle, shows where a symmetric shape is if it moves by so many limits.
PROTRUDING, MOVED = 0.97, 3.5
CORNER = 1.5  # of the spacing: so far from a point, along its plane, its surface reaches


class ModelSurface:
    """A model (M, 3) with its local planes."""

    def __init__(self, points: np.ndarray) -> None:
        self.points = np.ascontiguousarray(points, np.float64)
        self.center, self.noise = np.zeros(3), 0.0  # of the whole shape, and of some points, if it is completed
        self.tree = cKDTree(self.points)
        neighbors = min(8 if len(points) < 256 else 10 if len(points) < 512 else 12, len(points) - 1)
        distances, rows = self.tree.query(self.points, neighbors + 1)
        self.spacing = max(float(np.median(distances[:, 1])), LEAST_SPACING)
        self.spacing_M = distances[:, 1:4].mean(axis=1)  # mean distance to the three nearest
        around = self.points[rows]  # each point first
        self.centers, axes = _planes(around)
        others, other_axes = _planes(around[:, 1:])
        self.normals, self.tangents = axes[:, :, 0], np.swapaxes(axes[:, :, 1:], 1, 2)  # (M, 3) and (M, 2, 3)
        own = dots(self.points - self.centers, self.normals)
        left_out = dots(self.points - others, other_axes[:, :, 0])
        # Variance of the distances to planes fitted without the point, beyond that to planes fitted with it.
        self.roughness = max(trimmed_square(left_out) - trimmed_square(own), 0.0)

    @cached_property
    def symmetries(self) -> dict[str, list]:
        """The turns that leave the shape as it is (:func:`gpca.objects.bop.find_symmetries`)."""
        return self._turns(self.distances)

    def _turns(self, distances: Callable[[np.ndarray], np.ndarray]) -> dict[str, list]:
        limit = SYMMETRIC + SPARSE * self.spacing + NOISY * self.noise
        centered = self.points[:JUDGED] - self.center
        return find_symmetries(centered, 1.0, lambda points: distances(points + self.center), limit)

    @property
    def symmetric(self) -> bool:
        """Whether some turn leaves the shape as it is; errors then are those of the nearest points."""
        return bool(self.symmetries)

    def residuals(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the signed distances (N,) of points (N, 3) from the plane of the nearest model point, and its row."""
        target, rows_M, _, _ = self._target
        rows = np.empty(len(points), np.int64)
        nearest_rows(np.ascontiguousarray(points), target, rows)
        far = rows < 0
        rows = rows_M[rows]
        if far.any():
            rows[far] = self.tree.query(points[far])[1]
        return dots(points - self.centers[rows], self.normals[rows]), rows

    def distances(self, points: np.ndarray) -> np.ndarray:
        """Return the distances (N,) of points (N, 3) from the surface."""
        target, _, normals, reach = self._target
        distance_N = np.empty(len(points))
        surface_distances(np.ascontiguousarray(points), target, normals, reach, distance_N)
        return distance_N

    def errors(self, T_n: np.ndarray) -> np.ndarray:
        """Return the errors (n,) of poses (n, 4, 4) where the identity is right: ADD, or for symmetric models the mean
        distance from the surface, which does not grow with the points' spacing as ADD-S does."""
        points = self.points[:JUDGED]
        if not self.symmetric:
            return _add(T_n, points)
        moved = _moved(T_n, points)
        return self.distances(moved.reshape(-1, 3)).reshape(moved.shape[:2]).mean(axis=1)

    def errors_up_to_symmetry(self, T_n: np.ndarray) -> np.ndarray:
        """Return the errors (n,) of poses (n, 4, 4) where the identity is right: ADD from the nearest of the poses at
        which the model looks the same, as in BOP's MSSD. :meth:`errors` hardly sees a box that slides along itself."""
        if not self.symmetric:
            return self.errors(T_n)
        turns_n = np.array([symmetric_turn(T[:3, :3], self._equivalent) for T in T_n])
        about_center_n = rigid_motion(turns_n, self.center - turns_n @ self.center)
        return _add(T_n @ about_center_n, self.points[:JUDGED])

    @cached_property
    def _equivalent(self) -> dict[str, list]:
        """The symmetries after which no part, such as a handle, lies elsewhere."""

        def uneven(points: np.ndarray) -> np.ndarray:
            distance_N = np.sort(self.distances(points))
            return np.maximum(distance_N.mean(), distance_N[int(PROTRUDING * len(distance_N))] / MOVED)

        return self._turns(uneven)

    def completed(self, points: np.ndarray, noise: float) -> ModelSurface:
        """Return the surface with noisy points (N, 3) of the part that the model lacks."""
        whole = ModelSurface(np.concatenate([self.points, points]))
        whole.center, whole.noise = (whole.points.min(axis=0) + whole.points.max(axis=0)) / 2, noise
        return whole

    def apart(self, T_between_n: np.ndarray) -> np.ndarray:
        """Return how far (n,) the surface lies from itself after each motion (n, 4, 4)."""
        points = self.points[:COMPARED]
        distance_n_P = self.distances(_moved(T_between_n, points).reshape(-1, 3)).reshape(len(T_between_n), -1)
        distance_n_P.partition(farthest := int(PART * len(points)), axis=1)
        return np.maximum(distance_n_P.mean(axis=1), distance_n_P[:, farthest] / UNEVEN)

    @cached_property
    def regions(self) -> Regions:
        """The parts of it that may have been observed."""
        return Regions(self.points, self.spacing)

    @cached_property
    def _target(self):
        """The points for compiled searches, and their rows in `points`, normals, and how far their surface reaches."""
        target = make_target(self.points, LARGEST_ERROR)
        rows_M = self.tree.query(target.points)[1]
        return target, rows_M, self.normals[rows_M], CORNER * self.spacing_M[rows_M]


def trimmed_square(values: np.ndarray) -> float:
    """Return the mean square of the smallest values (N,), `TRIMMED` of them."""
    squares = np.sort(np.square(values))
    return float(squares[: max(1, int(TRIMMED * len(squares)))].mean())


def _planes(around_M_k_3: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return centers (M, 3) and axes (M, 3, 3) of the points around each, the normal's column first."""
    centers = around_M_k_3.mean(axis=1)
    moments = second_moments(around_M_k_3 - centers[:, None])
    return centers, np.linalg.eigh(moments)[1]


def _add(T_n: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the mean distance (n,) of points (N, 3) from themselves after each motion (n, 4, 4)."""
    return np.sqrt(np.square(_moved(T_n, points) - points).sum(axis=2)).mean(axis=1)


def _moved(T_n: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return points (N, 3) after each motion (n, 4, 4) as (n, N, 3), summed from x to z."""
    x, y, z = points.T
    rows = T_n[:, :3, :, None]
    return np.moveaxis(x * rows[:, :, 0] + y * rows[:, :, 1] + z * rows[:, :, 2] + rows[:, :, 3], 1, 2)


BEYOND = 2.5  # observed points that may lie beyond the plane,
BEYOND_SHARE = 0.01  # or this share of them
LEAST_SHARE = 0.07  # of the model, that counts as missing: as much may lie beyond the plane by chance
LEAST_KEPT = 0.125  # of the model


def share_within(model: np.ndarray, observed: np.ndarray, noise: float, random: np.random.Generator) -> float:
    """Return the least share of a model (M, 3) before any plane that what was observed (N, 3) does not pass."""
    return _cut(model, observed, noise * random.normal(size=len(model)))[1]


def covered_points(
    surface: ModelSurface, observed: np.ndarray, noise: float, random: np.random.Generator
) -> np.ndarray:
    """Return which points (M,) of a model were observed, by points (N, 3) without outliers."""
    return surface.regions.likeliest(before_plane(surface.points, observed, noise, random), observed, noise)


def before_plane(model: np.ndarray, observed: np.ndarray, noise: float, random: np.random.Generator) -> np.ndarray:
    """Return which points of a model (M, 3) lie on the side of the plane that was observed, (M,) bool."""
    blur_M = noise * random.normal(size=len(model))
    direction, share, limit = _cut(model, observed, blur_M)
    if share > 1 - LEAST_SHARE:
        return np.ones(len(model), bool)
    along_M = (model * direction).sum(axis=1)
    order_M = np.argsort(along_M, kind="stable")
    # As many points, in their order, as let the allowed share of them lie beyond the limit.
    over_M = np.cumsum((along_M + blur_M)[order_M] > limit) / np.arange(1, len(model) + 1)
    reaching = np.flatnonzero(over_M > _beyond(len(observed)) / len(observed))
    kept = max(int(LEAST_KEPT * len(model)), int(reaching[0]) if len(reaching) else len(model))
    covered_M = np.zeros(len(model), bool)
    covered_M[order_M[:kept]] = True
    return covered_M


def _cut(model: np.ndarray, observed: np.ndarray, blur_M: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Return the direction (3,) in which the least of the model lies before the limit of what was observed."""
    share_K, limit_K = np.empty(DIRECTIONS), np.empty(DIRECTIONS)
    observed = np.ascontiguousarray(observed)
    shares_within(directions(), observed, model, blur_M, _beyond(len(observed)), limit_K, share_K)
    best = int(share_K.argmin())
    return directions()[best], float(share_K[best]), float(limit_K[best])


def _beyond(count: int) -> int:
    return max(0, count - 1 - int(np.ceil((1 - max(BEYOND_SHARE, BEYOND / count)) * (count - 1))))
