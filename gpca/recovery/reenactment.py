"""A robot's re-enactment of its own registration: what its shots say of the true pose, and what each cause adds.

Hypotheses and their enactment are those of :mod:`gpca.reenactment`. From the shots a robot knows two more things than a
pair of clouds tells: that a pose puts surface where the camera looked and measured something else, and which surface no
camera has seen. Nothing here is told the true pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

import numpy as np
from scipy.special import expit

from gpca.alignment.rigid import inverse, rotate, scale_translation, transform
from gpca.causes.counterfactuals import Counterfactuals, Registrar, Unmeasurable
from gpca.causes.settings import CauseSettings
from gpca.causes.shapley import SUBSETS, shapley_values
from gpca.causes.truth import LARGEST_ERROR, capped
from gpca.frames.camera import MeshScene
from gpca.frames.shots import NEAR, Shot, fuse
from gpca.recovery.actions import Holding, Robot
from gpca.recovery.appearance import Appearance
from gpca.reenactment.enactment import start_twists
from gpca.reenactment.hypotheses import Hypothesis, find_hypotheses, weights_of
from gpca.reenactment.observation import NoiseScale, observe
from gpca.reenactment.rebuilding import rebuild
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.reenactment.verdict import SMALLEST_ERROR, STEEPNESS
from gpca.seeds import generator

OBSERVED_POINTS, MODEL_POINTS = 384, 768  # that are re-enacted, at most
PIXELS = 30  # so many pixels are independent of each other,
UNEXPLAINED = 0.1  # and each disagrees with the true pose with this probability
LEAST_COVERED = 0.05  # share of the model; a hypothesis that explains less says nothing of what was seen


@dataclass(frozen=True)
class KnownModel:
    """An object's model as a surface, in diameters.

    Attributes:
        surface: of `MODEL_POINTS` points. normals: (M, 3) of these, outward.
        scale: tells noise.
        mesh: in meters.
        diameter_m: the object's.
    """

    surface: ModelSurface
    normals: np.ndarray
    scale: NoiseScale
    mesh: MeshScene
    diameter_m: float

    @classmethod
    def of(cls, robot: Robot, random: np.random.Generator) -> KnownModel:
        """Return what a robot knows of an object's shape."""
        surface = ModelSurface(robot.points_m[:MODEL_POINTS].astype(np.float64) / robot.diameter_m)
        mesh = MeshScene([(robot.vertices_m, robot.faces)])
        return cls(surface, robot.normals[:MODEL_POINTS], NoiseScale(surface, random), mesh, robot.diameter_m)


@dataclass(frozen=True)
class Belief:
    """Where the object may be, after a registration.

    Attributes:
        hypotheses: K of the true pose, each from where the registration began.
        observed: (N, 3) of what was measured there, in diameters.
        weight_K: their probabilities.
        error_K: v̂(all), how far the pose that the registration ended at is off under each, in diameters.
        failure_K: how probable it is under each that this is no right pose.
        seconds: that it took.
    """

    hypotheses: Sequence[Hypothesis]
    observed: np.ndarray
    weight_K: np.ndarray
    error_K: np.ndarray
    failure_K: np.ndarray
    seconds: float

    @property
    def failure(self) -> float:
        """The probability that the registration has failed."""
        return float((self.weight_K * self.failure_K).sum())


@dataclass(frozen=True)
class Reenacted:
    """A registration's counterfactuals under each hypothesis.

    Attributes:
        belief: the hypotheses.
        error_K_8: v̂ of every subset of the causes, the mean over the starts, in diameters.
        seconds: that all took.
    """

    belief: Belief
    error_K_8: np.ndarray
    seconds: float

    @property
    def phi_3(self) -> np.ndarray:
        """φ̂, what each cause adds to the error, if the registration has failed: the mean over the hypotheses.

        A hypothesis counts by how probable it is, times how probable the failure is under it.
        """
        weight_K = self.belief.weight_K * self.belief.failure_K
        return (weight_K[:, None] * shapley_values(self.error_K_8)).sum(axis=0) / weight_K.sum()


def believe(
    holding: Holding, known: KnownModel, settings: ReenactmentSettings, truth: CauseSettings, axes: tuple
) -> Belief:
    """Find hypotheses of the true pose.

    A failure is as probable as not where the error is the limit of a failed registration.

    Args:
        truth: of it, this limit is read.
        axes: name the random numbers.
    """
    started = perf_counter()
    d, T_init = known.diameter_m, holding.T_world_object_init
    random = generator(*axes, "hypotheses")
    cloud_m = fuse(holding.shots, d, holding.filtered)
    cloud_m = cloud_m[np.sort(random.permutation(len(cloud_m))[:OBSERVED_POINTS])]
    observed = transform(inverse(T_init), cloud_m) / d
    T_result = scale_translation(inverse(holding.T_world_object) @ T_init, 1 / d)
    evidence = partial(_evidence, holding, known, Appearance(holding.shots, known.mesh))
    hypotheses = find_hypotheses(observed, known.surface, T_result[None], settings, random, evidence)
    T_off_K = np.stack([T_result @ inverse(hypothesis.T) for hypothesis in hypotheses])
    error_K = capped(known.surface.errors(T_off_K))
    failure_K = expit(STEEPNESS * np.log(np.maximum(error_K, SMALLEST_ERROR) / truth.limits.failed))
    return Belief(hypotheses, observed, weights_of(hypotheses), error_K, failure_K, perf_counter() - started)


def reenact(belief: Belief, holding: Holding, known: KnownModel, truth: CauseSettings, axes: tuple) -> Reenacted:
    """Register with every subset of the causes, as if each hypothesis were true in turn.

    Without noise and without missing surface, the measurement is rebuilt (:func:`gpca.reenactment.rebuilding.rebuild`);
    without a pose error, the registration starts from the hypothesis.

    Args:
        truth: how counterfactuals are registered.
        axes: name the random numbers.
    """
    started = perf_counter()
    random = generator(*axes, "clouds")
    xi_n_6 = start_twists(axes, truth)
    error_K_8 = []
    for hypothesis in belief.hypotheses:
        observation = observe(belief.observed, hypothesis, known.surface, known.scale, random)
        covered_M = seen_surface(holding, known, hypothesis, observation.noise)
        if covered_M.mean() >= LEAST_COVERED:
            observation = replace(observation, covered=covered_M)
        candidate = rebuild(hypothesis.T, observation, known.surface, random)
        measured = Counterfactuals(Registrar(candidate, truth, misses=True), known.surface.errors, xi_n_6, truth)
        error_K_8.append([_error(measured, subset) for subset in range(len(SUBSETS))])
    return Reenacted(belief, np.array(error_K_8), belief.seconds + perf_counter() - started)


def seen_surface(holding: Holding, known: KnownModel, hypothesis: Hypothesis, noise: float) -> np.ndarray:
    """Return which of the model's points (M,) some shot has measured, if a hypothesis is true.

    Such a point faces the camera, and what was measured at its pixel is the object, as far away as it should be.

    Args:
        noise: of the measurement, standard deviation in diameters.
    """
    d, T = known.diameter_m, _placed(holding, known, hypothesis.T)
    placed_m, facing_out = transform(T, d * known.surface.points), rotate(T, known.normals)
    reach_m = d * (NEAR + 2 * noise)
    seen_M = np.zeros(len(placed_m), bool)
    for shot in holding.shots:
        v, u, depth_m = shot.project(placed_m)
        near = np.abs(shot.depth_m[v, u] - depth_m) < reach_m
        seen_M |= _faces(placed_m, facing_out, shot) & (v >= 0) & shot.mask[v, u] & near
    return seen_M


def _faces(placed_m: np.ndarray, facing_out: np.ndarray, shot: Shot) -> np.ndarray:
    return np.sum(facing_out * (placed_m - shot.T_world_camera[:3, 3]), axis=1) < 0


def _placed(holding: Holding, known: KnownModel, T: np.ndarray) -> np.ndarray:
    """Return the ``T_world_object`` of a hypothesis."""
    return holding.T_world_object_init @ scale_translation(inverse(T), known.diameter_m)


def _evidence(holding: Holding, known: KnownModel, appearance: Appearance, T: np.ndarray, width: float) -> float:
    """Return the log-probability of the pixels around the object, if a hypothesis is true."""
    reach_m = known.diameter_m * max(NEAR, 2.5 * width)
    explained = appearance.explained(_placed(holding, known, T), reach_m)
    return PIXELS * (explained * float(np.log(1 - UNEXPLAINED)) + (1 - explained) * float(np.log(UNEXPLAINED)))


def _error(measured: Counterfactuals, subset: int) -> float:
    try:
        return measured.error(subset)
    except Unmeasurable:
        return LARGEST_ERROR
