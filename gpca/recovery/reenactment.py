"""A robot's re-enactment of its own registration: where it looked through a pose, and what no camera has seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from scipy.special import expit

from gpca.causes.settings import CauseSettings
from gpca.causes.truth import capped, shapley_values
from gpca.frames.shots import NEAR, Shot, fuse
from gpca.objects.camera import MeshScene
from gpca.recovery.actions import Holding, Robot
from gpca.reenactment.enactment import NoiseScale, enact, observe, rebuild
from gpca.reenactment.hypotheses import Hypothesis, find_hypotheses, weights_of
from gpca.reenactment.settings import SMALLEST_ERROR, STEEPNESS, ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import inverse, rotate, scale_translation, transform
from gpca.seeds import generator

OBSERVED_POINTS, MODEL_POINTS = 384, 768  # largest numbers of re-enacted points
PIXELS = 30  # number of independent pixels
UNEXPLAINED = 0.1  # probability that a pixel disagrees with the true pose
LEAST_COVERED = 0.05  # share of the model; below it, a hypothesis does not determine which surface was seen
THINNED = 4  # step between the compared pixels, in both directions


def appearance(shots: Sequence[Shot], mesh: MeshScene) -> Callable[[np.ndarray, float], float]:
    """Return what tells the share of pixels that agree with a pose, of those that show the object or should."""
    thin = np.s_[THINNED // 2 :: THINNED, THINNED // 2 :: THINNED]
    views = [(each.T_world_camera, each.camera.rays()[thin], each.depth_m[thin], each.mask[thin]) for each in shots]

    def explained(T_world_object: np.ndarray, reach_m: float) -> float:
        agreeing = judged = 0
        for T_world_camera, rays, depth_m, is_object in views:
            rendered_m = mesh.along(rays, inverse(T_world_object) @ T_world_camera).depth_m
            measured = depth_m > 0
            hidden = ~is_object & (depth_m < rendered_m - reach_m)
            expected = np.isfinite(rendered_m)
            near = np.abs(np.where(expected, rendered_m, np.inf) - depth_m) < reach_m
            agreeing += (measured & is_object & near).sum()
            judged += (measured & (is_object | (expected & ~hidden))).sum()
        return float(agreeing / max(1, judged))

    return explained


@dataclass(frozen=True)
class KnownModel:
    """An object's model as a surface, in diameters."""

    surface: ModelSurface  # of `MODEL_POINTS` points
    normals: np.ndarray  # (M, 3) theirs, outward
    scale: NoiseScale
    mesh: MeshScene  # in meters
    diameter_m: float

    @classmethod
    def of(cls, robot: Robot, random: np.random.Generator) -> KnownModel:
        """Return the model of a robot's object."""
        surface = ModelSurface(robot.points_m[:MODEL_POINTS].astype(np.float64) / robot.diameter_m)
        mesh = MeshScene([(robot.vertices_m, robot.faces)])
        return cls(surface, robot.normals[:MODEL_POINTS], NoiseScale(surface, random), mesh, robot.diameter_m)


@dataclass(frozen=True)
class Belief:
    """Hypotheses of the object's pose after a registration."""

    hypotheses: Sequence[Hypothesis]  # K, relative to the initial pose
    observed: np.ndarray  # (N, 3) measured points at the initial pose, in diameters
    weight_K: np.ndarray  # probabilities of the hypotheses
    error_K: np.ndarray  # v̂(all), error of the registration's result under each, in diameters
    failure_K: np.ndarray  # probability of a failure under each
    seconds: float

    @property
    def failure(self) -> float:
        """The probability that the registration has failed."""
        return float((self.weight_K * self.failure_K).sum())


@dataclass(frozen=True)
class CauseEffects:
    """Counterfactuals of a registration under each hypothesis."""

    belief: Belief
    error_K_8: np.ndarray  # v̂ of every subset of the causes, mean over the starts, in diameters
    seconds: float  # in total

    @property
    def phi_3(self) -> np.ndarray:
        """φ̂, effect of each cause on the error, given a failure: a mean weighted by P(hypothesis, failure)."""
        weight_K = self.belief.weight_K * self.belief.failure_K
        return (weight_K[:, None] * shapley_values(self.error_K_8)).sum(axis=0) / weight_K.sum()


def believe(
    holding: Holding, shape: KnownModel, settings: ReenactmentSettings, truth: CauseSettings, axes: tuple
) -> Belief:
    """Find hypotheses of the true pose; at the limit of a failed registration, a failure has probability 1/2."""
    started = perf_counter()
    d, T_init = shape.diameter_m, holding.T_world_object_init
    random = generator(*axes, "hypotheses")
    cloud_m = fuse(holding.shots, d, holding.filtered)
    cloud_m = cloud_m[np.sort(random.permutation(len(cloud_m))[:OBSERVED_POINTS])]
    observed = transform(inverse(T_init), cloud_m) / d
    T_result = scale_translation(inverse(holding.T_world_object) @ T_init, 1 / d)
    explained_at = appearance(holding.shots, shape.mesh)

    def evidence(T: np.ndarray, width: float) -> float:
        explained = explained_at(_placed(holding, shape, T), d * max(NEAR, 2.5 * width))
        return PIXELS * (explained * float(np.log(1 - UNEXPLAINED)) + (1 - explained) * float(np.log(UNEXPLAINED)))

    hypotheses = find_hypotheses(observed, shape.surface, T_result[None], settings, random, evidence)
    T_off_K = np.stack([T_result @ inverse(hypothesis.T) for hypothesis in hypotheses])
    error_K = capped(shape.surface.errors(T_off_K))
    failure_K = expit(STEEPNESS * np.log(np.maximum(error_K, SMALLEST_ERROR) / truth.limits.failed))
    return Belief(hypotheses, observed, weights_of(hypotheses), error_K, failure_K, perf_counter() - started)


def reenact(belief: Belief, holding: Holding, shape: KnownModel, truth: CauseSettings, axes: tuple) -> CauseEffects:
    started, random, error_K_8 = perf_counter(), generator(*axes, "clouds"), []
    for hypothesis in belief.hypotheses:
        observation = observe(belief.observed, hypothesis, shape.surface, shape.scale, random)
        covered_M = seen_surface(holding, shape, hypothesis, observation.noise)
        if covered_M.mean() >= LEAST_COVERED:
            observation = replace(observation, covered=covered_M)
        candidate = rebuild(hypothesis.T, observation, shape.surface, random)
        error_K_8.append(enact(hypothesis, candidate, shape.surface.errors, axes, truth, misses=True).error_8)
    return CauseEffects(belief, np.array(error_K_8), belief.seconds + perf_counter() - started)


def seen_surface(holding: Holding, shape: KnownModel, hypothesis: Hypothesis, noise: float) -> np.ndarray:
    """Return which model points (M,) face a camera of a shot that measured them, with noise in diameters."""
    d, T = shape.diameter_m, _placed(holding, shape, hypothesis.T)
    placed_m, normals = transform(T, d * shape.surface.points), rotate(T, shape.normals)
    reach_m = d * (NEAR + 2 * noise)
    seen_M = np.zeros(len(placed_m), bool)
    for shot in holding.shots:
        v, u, depth_m = shot.project(placed_m)
        near = np.abs(shot.depth_m[v, u] - depth_m) < reach_m
        facing = np.sum(normals * (placed_m - shot.T_world_camera[:3, 3]), axis=1) < 0
        seen_M |= facing & (v >= 0) & shot.mask[v, u] & near
    return seen_M


def _placed(holding: Holding, shape: KnownModel, T: np.ndarray) -> np.ndarray:
    return holding.T_world_object_init @ scale_translation(inverse(T), shape.diameter_m)
