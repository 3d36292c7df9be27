"""The truth's counterfactuals under hypotheses of an observer: v̂, û and φ̂."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter

import numpy as np

from gpca.causes.candidate import Candidate, Counterfactuals, Registrar, Unmeasurable
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import LARGEST_ERROR, SUBSETS, shapley_values
from gpca.pairs.distances import ObservedPair
from gpca.reenactment.hypotheses import Hypothesis, find_hypotheses, fits_at
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface, covered_points, trimmed_square
from gpca.rigid import inverse, transform
from gpca.seeds import generator

NOISES = np.array([0.0, 0.01, 0.02, 0.03, 0.045, 0.06, 0.08, 0.11])  # diameters, that are simulated
SIMULATED = 512  # points, at least
FEWEST_INLIERS = 16
FAR = 2.0  # widths of the mixture from the model's surface, from which a point may be where it lacks some
QUIET = 0.004  # diameters; noise that is no larger is none


class NoiseScale:
    """Tells noise from the distances of points to a model's planes, by noise that is simulated on the model itself."""

    def __init__(self, surface: ModelSurface, random: np.random.Generator) -> None:
        points = np.tile(surface.points, (max(1, -(-SIMULATED // len(surface.points))), 1))
        unit = random.normal(size=points.shape)
        squares = [trimmed_square(surface.residuals(points + noise * unit)[0]) for noise in NOISES]
        roots = np.sqrt(np.array(squares) + surface.roughness)
        self._roots = np.maximum.accumulate(roots + 1e-9 * np.arange(len(roots)))

    def noise(self, residuals_N: np.ndarray) -> float:
        """Return the standard deviation per axis, in diameters, that makes distances from planes as large as these."""
        return float(np.interp(np.sqrt(trimmed_square(residuals_N)), self._roots, NOISES))


@dataclass(frozen=True)
class Observation:
    """The observed points (N, 3) where a hypothesis puts them in the model."""

    points: np.ndarray
    is_outlier: np.ndarray  # (N,)
    is_lone: np.ndarray  # (N,) which lie on surface that the model lacks
    noise: float  # standard deviation per axis, diameters
    residuals: np.ndarray  # (N,) signed distance from the plane of the nearest model point,
    rows: np.ndarray  # (N,) and that point
    covered: np.ndarray  # (M,) which points of the model were observed

    @property
    def outliers(self) -> float:
        """The share of the points that are outliers."""
        return float(self.is_outlier.mean())


def observe(
    observed: np.ndarray, hypothesis: Hypothesis, surface: ModelSurface, scale: NoiseScale, random: np.random.Generator
) -> Observation:
    """Return what a hypothesis says of the observed points (N, 3)."""
    points = transform(hypothesis.T, observed)
    is_outlier, is_lone = kinds(points, hypothesis, surface)
    matched = ~is_outlier & ~is_lone
    residuals, rows = surface.residuals(points)
    noise = scale.noise(residuals[matched])
    covered = covered_points(surface, points[matched], noise, random)
    return Observation(points, is_outlier, is_lone, noise, residuals, rows, covered)


def kinds(points: np.ndarray, hypothesis: Hypothesis, surface: ModelSurface) -> tuple[np.ndarray, np.ndarray]:
    """Return which points (N, 3) are outliers, and which lie on surface that the model lacks."""
    is_outlier = hypothesis.inlier_N <= 0.5
    fewest = min(len(points), max(FEWEST_INLIERS, len(points) // 2))
    if (~is_outlier).sum() < FEWEST_INLIERS:
        is_outlier = np.ones(len(points), bool)
        is_outlier[np.argsort(-hypothesis.inlier_N, kind="stable")[:fewest]] = False
    is_lone = ~is_outlier & (hypothesis.lone_N > 0.5) & (surface.distances(points) > FAR * hypothesis.width)
    if (~is_outlier & ~is_lone).sum() < FEWEST_INLIERS:
        is_lone = np.zeros(len(points), bool)
    return is_outlier, is_lone


LEAST_LACKING = 0.05  # share of the points on surface that the model lacks; fewer are none
FEW_OUTLIERS = 0.01  # share of the points; fewer are none
MOST_ADDED = 1024  # points
BESIDE = 0.6  # of the spacing: so far from a model's point, in its plane, a fresh point may lie


def rebuild(T: np.ndarray, observation: Observation, surface: ModelSurface, random: np.random.Generator) -> Candidate:
    """Return the pair as a candidate of the truth: what was observed is its noisy cloud, of which a part is kept.

    Points move to their planes; outliers and missing surface become fresh points.
    """
    noise, missing = observation.noise, float(1 - observation.covered.mean())  # of the model
    quiet = noise <= QUIET and observation.outliers < FEW_OUTLIERS
    clean = observation.points
    covered, absent = np.flatnonzero(observation.covered), np.flatnonzero(~observation.covered)
    if not quiet:
        if noise > QUIET:
            moved = noise**2 / (noise**2 + surface.roughness) * observation.residuals * ~observation.is_lone
            clean = clean - moved[:, None] * surface.normals[observation.rows]
        fresh = fresh_points(surface, covered, len(clean), random)
        clean = np.where(observation.is_outlier[:, None], fresh, clean)
    count = min(MOST_ADDED, round((~observation.is_lone).sum() * missing / (1 - missing)))
    lacking = observation.is_lone.mean() >= LEAST_LACKING
    added = fresh_points(surface, absent, count, random) if count else np.empty((0, 3))
    jitter, anywhere = random.normal(size=added.shape), random.uniform(-0.5, 0.5, size=added.shape)
    scattered = random.random(count) < observation.outliers
    noisy = np.where(scattered[:, None] & (not quiet), anywhere, added + (noise > QUIET) * noise * jitter)
    return Candidate(
        applied=np.array([not quiet, True, count > 0 or lacking]),  # noise, pose, overlap
        model=surface.points,
        whole_model=np.concatenate([surface.points, clean[observation.is_lone]]) if lacking else None,
        clean=np.concatenate([clean, added]),
        noisy=np.concatenate([observation.points, noisy]),
        seen=np.arange(len(clean) + count),
        kept=np.arange(len(clean)),
        T_near=np.eye(4),
        T_init=inverse(T),
        severity={"noise": noise, "outliers": observation.outliers, "crop": missing},
    )


def is_whole(surface: ModelSurface, is_lone: np.ndarray) -> bool:
    """Return whether next to none of the points (N,) lie on surface that the model lacks."""
    return bool(is_lone.mean() < LEAST_LACKING) or surface.symmetric


def completed(surface: ModelSurface, observation: Observation) -> ModelSurface:
    """Return the surface with what was observed of the part that the model lacks, if it lacks any."""
    if is_whole(surface, observation.is_lone):
        return surface
    return surface.completed(observation.points[observation.is_lone], observation.noise)


class Stayed:
    """What a pose (4×4), if it is true as it is, says of observed points (N, 3)."""

    def __init__(self, T: np.ndarray, observed: np.ndarray, surface: ModelSurface) -> None:
        self._observed, self._surface, fits = observed, surface, fits_at(T[None], observed, surface)
        lone_N, numbers = fits.lone_n_N[0], (float(fits.log_likelihood_n[0]), float(fits.width_n[0]))
        self._hypothesis = Hypothesis(T, fits.inlier_n_N[0] + lone_N, *numbers, 1, 0, lone_N)

    def observation(self) -> Observation:
        """Return what it says."""
        random = generator("whole surface")
        scale = NoiseScale(self._surface, random)
        return observe(self._observed, self._hypothesis, self._surface, scale, random)

    def whole_surface(self) -> ModelSurface:
        """Return the completed surface, by which errors are measured."""
        _, is_lone = kinds(transform(self._hypothesis.T, self._observed), self._hypothesis, self._surface)
        return self._surface if is_whole(self._surface, is_lone) else completed(self._surface, self.observation())


def fresh_points(surface: ModelSurface, rows: np.ndarray, count: int, random: np.random.Generator) -> np.ndarray:
    """Return points (count, 3) of the surface around some of the model's points."""
    chosen = random.choice(rows, size=count, replace=count > len(rows))
    beside = random.uniform(-BESIDE, BESIDE, size=(count, 2, 1)) * surface.spacing_M[chosen, None, None]
    return surface.points[chosen] + (beside * surface.tangents[chosen]).sum(axis=1)


@dataclass(frozen=True)
class Enactment:
    """One hypothesis and what the registration would have done, were it true."""

    hypothesis: Hypothesis
    candidate: Candidate  # its severities are what the hypothesis says of noise, outliers and crop
    error_8: np.ndarray  # v̂ and
    uncertainty_8: np.ndarray  # û of every subset of the causes, as in :class:`gpca.causes.truth.Truth`
    errors: Callable[[np.ndarray], np.ndarray]  # of poses (n, 4, 4) where the identity is right, diameters
    icp_seconds: float  # that the registrations took

    @cached_property
    def phi_3(self) -> np.ndarray:
        """φ̂, what each cause adds to the error."""
        return shapley_values(self.error_8[None])[0]


def reenact(
    pair: ObservedPair, settings: ReenactmentSettings, truth: CauseSettings, surface: ModelSurface | None = None
) -> list[Enactment]:
    """Find hypotheses of the true pose and enact each, the most probable first."""
    surface = surface or ModelSurface(pair.model)
    before = transform(pair.T_init, pair.observed)
    T_found_n = pair.T_runs @ inverse(pair.T_init)
    random = generator(*pair.axes, "hypotheses")
    hypotheses = find_hypotheses(before, surface, T_found_n, settings, random)
    scale, whole = NoiseScale(surface, random), surface
    enactments: list[Enactment] = []
    for hypothesis in hypotheses:
        observation = observe(before, hypothesis, surface, scale, random)
        if not enactments:
            whole = completed(surface, observation)
        candidate = rebuild(hypothesis.T, observation, surface, random)
        enactments.append(enact(hypothesis, candidate, whole.errors, pair.axes, truth))
    return enactments


def enact(
    hypothesis: Hypothesis,
    candidate: Candidate,
    errors: Callable[[np.ndarray], np.ndarray],
    axes: tuple,
    truth: CauseSettings,
    misses: bool = False,
) -> Enactment:
    """Register every subset of a candidate's causes, as if a hypothesis were true, from the same starts, which the axes
    name; what cannot be registered is as wrong as can be."""
    started = perf_counter()
    xi_n_6 = generator(*axes, "starts").normal(size=(truth.starts, 6)) * truth.deviation_6()
    measured = Counterfactuals(Registrar(candidate, truth, misses), errors, xi_n_6, truth)
    error_8, uncertainty_8 = np.full(len(SUBSETS), LARGEST_ERROR), np.zeros(len(SUBSETS))
    for subset in range(len(SUBSETS)):
        with suppress(Unmeasurable):
            error_8[subset], uncertainty_8[subset] = measured.error(subset), measured.uncertainty(subset)
    return Enactment(hypothesis, candidate, error_8, uncertainty_8, errors, perf_counter() - started)
