"""How many times too large what was observed is for the model, by Gauss-Newton steps of similarities."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from gpca.pairs.distances import second_moments
from gpca.reenactment.hypotheses import INDEPENDENT, LEAST_COVERED, find_hypotheses
from gpca.reenactment.mixture import Mixture
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface, share_within, trimmed_square
from gpca.rigid import best_motion, dots, exp, rotate, transform

STARTS = (0.5, 0.72, 1.0, 1.4, 2.0)
FEW, STEPS, LAST_STEPS = 128, 8, 6  # points and steps of all starts; steps of the best, with all points
REACHES = (0.15, 0.03)  # diameters, from which points count less, at first and in the end
DAMPING = 1e-3  # of steps that the surface does not hold
LARGEST_STEP = 0.2  # of ln scale
ITERATIONS = 8  # of the mixture
DIMENSION, PRIOR = 2.0, 0.7
PROMISING, CONVINCING = 0.0, 5.0  # nats by few points, and by all, from which another scale is believed
ROUNDS = 3  # in which poses are sought at the scale that was found
LEAST_CHANGE = 0.05  # of the scale, that is a cause


@dataclass(frozen=True)
class Scale:
    """The scale of what was observed."""

    factor: float  # how many times too large it is for the model; 1 unless another scale fits better
    nats: float  # by which the posterior of another scale exceeds that of 1
    error: float = 0.0  # mean distance by which that moves the model's points; in diameters, until it is converted

    @property
    def off(self) -> bool:
        """Whether the scale is worth a word."""
        return abs(np.log(self.factor)) > np.log1p(LEAST_CHANGE)

    @property
    def words(self) -> str:
        """What to know of the scale; empty if it is right."""
        if not self.off:
            return ""
        too = f"{self.factor:.3g} times too large" if self.factor > 1 else f"{1 / self.factor:.3g} times too small"
        return f"the source seems {too} for the target"

    @property
    def advice(self) -> str:
        """What to do about a wrong scale."""
        return f"{self.words}: multiply its points by {1 / self.factor:.3g}"


def find_scale(
    observed: np.ndarray, T_k: Sequence[np.ndarray], surface: ModelSurface, random: np.random.Generator
) -> Scale:
    """Return the scale of an observed cloud (N, 3) relative to a surface, from probable poses (4, 4)."""
    scale = scale_of([transform(T, observed) for T in T_k], surface, random)
    center, factor = observed.mean(axis=0), scale.factor
    for _ in range(ROUNDS if scale.off else 0):
        resized = center + (observed - center) / factor
        hypotheses = find_hypotheses(resized, surface, np.stack(T_k), ReenactmentSettings(), random)
        rest = scale_of([transform(each.T, resized) for each in hypotheses[:2]], surface, random, 0.0)
        factor *= rest.factor
        if not rest.off:
            break
    radius = float(np.linalg.norm(surface.points - surface.points.mean(axis=0), axis=1).mean())
    return Scale(factor, scale.nats, abs(factor - 1) * radius)


def scale_of(
    placed: Sequence[np.ndarray], surface: ModelSurface, random: np.random.Generator, convincing: float = CONVINCING
) -> Scale:
    """Return the scale of an observed cloud that poses have placed in the model, each (N, 3)."""
    mixture = Mixture(surface.points, surface.spacing / 2)
    rows = np.linspace(0, len(placed[0]) - 1, min(FEW, len(placed[0]))).astype(int)
    few = [points[rows] for points in placed]
    starts = [(points, np.median(points, axis=0), start) for points in few for start in STARTS]
    scaled = np.stack([center + start * (points - center) for points, center, start in starts])
    ends, factor_B = _settled(scaled, surface, REACHES, STEPS)
    factor_B *= np.tile(STARTS, len(few))
    posterior_B = [_log_posterior(*end, mixture, surface, random) for end in zip(ends, factor_B, strict=True)]
    best = int(np.argmax(posterior_B))
    nats = posterior_B[best] - max(_log_posterior(points, 1.0, mixture, surface, random) for points in few)
    if nats < PROMISING:
        return Scale(1.0, nats)
    # The similarity of the few points moves all of them.
    pose = best // len(STARTS)
    T = best_motion(factor_B[best] * few[pose], ends[best], np.ones(len(rows)))
    moved = rotate(T, factor_B[best] * placed[pose]) + T[:3, 3]
    last, change_1 = _settled(moved[None], surface, (REACHES[1], REACHES[1]), LAST_STEPS)
    factor = float(factor_B[best] * change_1[0])
    plain = max(_log_posterior(points, 1.0, mixture, surface, random) for points in placed)
    nats = _log_posterior(last[0], factor, mixture, surface, random) - plain
    if nats < convincing:
        return Scale(1.0, nats)
    return Scale(_scale_of_model(last[0], surface, random) / factor, nats)


def _log_posterior(
    points: np.ndarray, factor: float, mixture: Mixture, surface: ModelSurface, random: np.random.Generator
) -> float:
    """Return nats, as :func:`gpca.reenactment.hypotheses.find_hypotheses` does, of scaled points where a pose is."""
    fits = mixture.fit(points, np.eye(4)[None], ITERATIONS)
    T, inlier_N, width = fits.T_n[0], fits.inlier_n_N[0] > 0.5, float(fits.width_n[0])
    seen = rotate(T, points[inlier_N] if inlier_N.sum() > 7 else points) + T[:3, 3]
    covered = share_within(surface.points, seen, 0.7 * width, random)
    density = (1 - fits.outliers_n[0]) * np.log(max(covered, LEAST_COVERED))
    return float(
        INDEPENDENT * (fits.log_likelihood_n[0] - density + np.log(factor) * (DIMENSION - PRIOR * np.log(factor)))
    )


def _settled(
    points_B_N_3: np.ndarray, surface: ModelSurface, reaches: tuple[float, float], steps: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return clouds (B, N, 3) where similarities end, and by which factors (B,) they have scaled them."""
    moved, factor_B = points_B_N_3, np.ones(len(points_B_N_3))
    for reach in np.geomspace(*reaches, steps):
        residual, rows = surface.residuals(moved.reshape(-1, 3))
        far = np.square(moved.reshape(-1, 3) - surface.points[rows]).sum(axis=1)
        shape = moved.shape[:2]
        weight_B_N = ((1 + far / reach**2) ** -2.0).reshape(shape)
        step_B_7, middle_B_1_3 = _steps(
            moved, surface.normals[rows].reshape(moved.shape), residual.reshape(shape), weight_B_N
        )
        grown_B = np.exp(np.clip(step_B_7[:, 6], -LARGEST_STEP, LARGEST_STEP))
        T_B = exp(step_B_7[:, :6])
        turned = np.einsum("bij,bnj->bni", T_B[:, :3, :3], grown_B[:, None, None] * (moved - middle_B_1_3))
        moved = middle_B_1_3 + turned + T_B[:, None, :3, 3]
        factor_B = factor_B * grown_B
    return moved, factor_B


def _steps(moved: np.ndarray, normals: np.ndarray, residual: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return twist and ln scale (B, 7) of weighted least squares on distances (B, N) from planes, and the center."""
    total_B = np.maximum(weight.sum(axis=1), 1e-9)
    middle = (np.einsum("bn,bni->bi", weight, moved) / total_B[:, None])[:, None]
    offset = moved - middle
    rows = np.concatenate([np.cross(offset, normals), normals, (offset * normals).sum(axis=2, keepdims=True)], axis=2)
    hessian = np.einsum("bn,bni,bnj->bij", weight, rows, rows)
    size_B = np.einsum("bn,bni->b", weight, offset**2)
    damped = DAMPING * np.stack([*[size_B] * 3, *[total_B] * 3, size_B], axis=1)
    hessian += damped[:, :, None] * np.eye(7)
    gradient = np.einsum("bn,bni,bn->bi", weight, rows, residual)
    return -np.linalg.solve(hessian, gradient[..., None])[..., 0], middle


def _scale_of_model(seen: np.ndarray, surface: ModelSurface, random: np.random.Generator) -> float:
    """Return the scale at which points of the model that lie near some (N, 3) fit planes of their neighbors."""
    points = surface.points
    near_M = cKDTree(seen).query(points, distance_upper_bound=2 * surface.spacing)[0] < np.inf
    kept = points[near_M] if near_M.sum() > 32 else points
    noise = np.sqrt(max(trimmed_square(surface.residuals(seen)[0]) - surface.roughness, 0.0))
    noisy = kept + noise * random.normal(size=kept.shape)
    row_M_k = surface.tree.query(noisy, 11)[1]
    same = (points[row_M_k] == kept[:, None]).all(axis=2)
    order = np.argsort(same, axis=1, kind="stable")[:, :10]
    around = points[np.take_along_axis(row_M_k, order, axis=1)]
    center = around.mean(axis=1)
    normals = np.linalg.eigh(second_moments(around - center[:, None]))[1][:, :, 0]
    residual = dots(noisy - center, normals)
    step_1_7, _ = _steps(noisy[None], normals[None], residual[None], np.ones((1, len(noisy))))
    return float(np.exp(step_1_7[0, 6]))
