"""Directions in which a pose is free: moved along one of them, what was observed fits the model as well.

Twists u are the eigenvectors of the mean of (nᵀJ u)(mᵀJ u) relative to |J u|², with normals n and m from other points.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.spatial import cKDTree

from gpca.pairs.distances import second_moments
from gpca.reenactment.mixture import Mixture
from gpca.rigid import dots, exp, point_jacobians

NEIGHBORS = 12  # of a point, every second of which spans one of its two planes
STEPS = np.array([0.06, 0.12])  # diameters that a pose is moved,
FAR_STEPS = np.array([0.12, 0.25, 0.5])  # and a free one again
WIDTHS = 1.0  # least width of the normals, in spacings: a narrower one holds a pose to the points, not to their surface
SETTLING = 4  # iterations after which the width is known
INDEPENDENT = 100  # points that the likelihood counts as
LEAST_LOSS = 1e-6  # nats
UNHELD = 0.5  # diameters, the largest standard deviation: what is known of a pose before
FREE, WEAK = 0.015, 0.03  # diameters, standard deviations from which a direction is not determined, and is not at all
FLAT = 0.01  # of the middle extent: a cloud whose smallest is no larger is flat
OUTLINE = 0.2  # of its longest extent, that a neighborhood of an outline is wide


@dataclass(frozen=True)
class Freedom:
    """The six directions of a pose; the last three are those out of the plane of outlines."""

    center_3: np.ndarray
    twists_6_6: np.ndarray  # a row each
    deviation_6: np.ndarray  # standard deviations, as displacements
    metric_6_6: np.ndarray  # ξᵀ M ξ is the mean squared displacement by ξ
    flat: np.ndarray | None  # (3,) normal of the plane of outlines, out of which nothing is measured

    @property
    def covariance(self) -> np.ndarray:
        """Return Σ (6, 6) of the twist."""
        return np.einsum("ki,k,kj->ij", self.twists_6_6, self.deviation_6**2, self.twists_6_6)

    @property
    def free_twists(self) -> np.ndarray:
        """Return the twists (k, 6) of the measured directions that are free."""
        measured = 6 if self.flat is None else 3
        return self.twists_6_6[:measured][self.deviation_6[:measured] > FREE]


class Holder:
    """A model (M, 3) that holds poses; `open_ends`: what lies beyond it may have been there, unseen."""

    def __init__(self, model: np.ndarray, tree: cKDTree, open_ends: bool = False) -> None:
        self._model, self._tree = model, tree
        distances, near_M_k = tree.query(model, min(NEIGHBORS, len(model) - 1) + 1)
        self.spacing = max(float(np.median(distances[:, 1])), 1e-4)
        around = model[near_M_k[:, 1:]]
        variance_3, axes_3_3 = np.linalg.eigh(np.cov(model.T))
        self.flat = axes_3_3[:, 0] if variance_3[0] <= FLAT**2 * variance_3[1] else None
        if self.flat is not None:
            extents_M_3 = np.linalg.eigvalsh(second_moments(around - around.mean(axis=1, keepdims=True)))
            if np.median(extents_M_3[:, 1]) > OUTLINE**2 * np.median(extents_M_3[:, 2]):
                self.flat = None  # it is a plane, not an outline in one
        self._normals = [_normals(around[:, half::2], 0 if self.flat is None else 1) for half in (0, 1)]
        self._mixture = None if open_ends and self.flat is None else Mixture(model, self.spacing / 2)

    def freedom(self, points: np.ndarray) -> Freedom:
        """Return how observed points (N, 3) are free that lie on the model, where a pose puts them."""
        center = points.mean(axis=0)
        jacobians_N_3_6 = point_jacobians(points - center)
        rows_N = self._tree.query(points)[1]
        first_N_3, second_N_3 = (normals[rows_N] for normals in self._normals)
        sign_N = np.where(dots(first_N_3, second_N_3) < 0, -1.0, 1.0)
        along = [np.einsum("ni,nij->nj", n, jacobians_N_3_6) for n in (first_N_3, sign_N[:, None] * second_N_3)]
        held_6_6 = np.einsum("ni,nj->ij", *along) / len(points)
        metric_6_6 = np.einsum("nij,nik->jk", jacobians_N_3_6, jacobians_N_3_6) / len(points)
        metric_6_6 += 1e-9 * np.trace(metric_6_6) * np.eye(6)  # points on a line do not turn about it
        inside_6_k, outside_6_k = _in_and_out(self.flat)
        twists_k_6, loose_k_6 = (
            (part @ eigh(part.T @ (held_6_6 + held_6_6.T) @ part, part.T @ metric_6_6 @ part)[1]).T
            for part in (inside_6_k, outside_6_k)
        )
        deviation_k = self._deviations(points, center, twists_k_6, STEPS)
        free = deviation_k > FREE
        if free.any():
            far_k = np.maximum(self._deviations(points, center, twists_k_6[free], FAR_STEPS), deviation_k[free])
            deviation_k[free] = np.where(far_k > WEAK, UNHELD, far_k)
        deviation_6 = np.concatenate([deviation_k, np.full(len(loose_k_6), UNHELD)])
        return Freedom(center, np.concatenate([twists_k_6, loose_k_6]), deviation_6, metric_6_6, self.flat)

    def _deviations(
        self, points: np.ndarray, center: np.ndarray, twists_k_6: np.ndarray, steps: np.ndarray
    ) -> np.ndarray:
        """Return the standard deviations (k,) along twists by the likelihood that is lost a few steps away."""
        xi = np.concatenate([sign * step * twists_k_6 for step in steps for sign in (-1, 1)])
        T_n = np.concatenate([np.eye(4)[None], exp(xi)])
        likelihood_n = self._likelihoods(points - center, T_n, center)
        lost = (likelihood_n[0] - likelihood_n[1:]).reshape(len(steps), 2, -1).mean(axis=1)
        deviations = steps[:, None] / np.sqrt(2 * INDEPENDENT * np.maximum(lost, LEAST_LOSS))
        return np.minimum(deviations.min(axis=0), UNHELD)

    def _likelihoods(self, points: np.ndarray, T_n: np.ndarray, center: np.ndarray) -> np.ndarray:
        """Return the mean log-likelihoods (n,) of points about a center at poses (n, 4, 4)."""
        if self._mixture is not None:
            T_n[:, :3, 3] += center
            width_1 = self._mixture.fit(points, T_n[:1], SETTLING, moving=False).width_n
            width_n = np.repeat(np.maximum(width_1, WIDTHS * self.spacing), len(T_n))
            return self._mixture.fit(points, T_n, 0, moving=False, width_n=width_n).log_likelihood_n
        moved = np.einsum("nij,Nj->nNi", T_n[:, :3, :3], points) + T_n[:, None, :3, 3] + center
        rows = self._tree.query(moved.reshape(-1, 3))[1]
        off = dots(moved.reshape(-1, 3) - self._model[rows], self._normals[0][rows]).reshape(len(T_n), -1)
        width = max(float(np.sqrt(np.median(off[0] ** 2)) * 1.5), 0.3 * self.spacing)
        return np.log(0.95 * np.exp(-0.5 * (off / width) ** 2) + 0.05).mean(axis=1)


def _in_and_out(flat: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return twists (6, k) within the plane of outlines, and those out of it; all and none where there is no plane."""
    if flat is None:
        return np.eye(6), np.empty((6, 0))
    plane_3_3 = np.linalg.svd(flat[None])[2]  # the normal first
    zero, (normal_3, *across) = np.zeros(3), plane_3_3
    slides = [np.concatenate([zero, axis]) for axis in across]
    tilts = [np.concatenate([axis, zero]) for axis in across]
    turn, lift = np.concatenate([normal_3, zero]), np.concatenate([zero, normal_3])
    return np.column_stack([turn, *slides]), np.column_stack([*tilts, lift])


def _normals(around_M_k_3: np.ndarray, column: int) -> np.ndarray:
    moments = second_moments(around_M_k_3 - around_M_k_3.mean(axis=1, keepdims=True))
    return np.linalg.eigh(moments)[1][:, :, column]
