"""Hypotheses of the true pose and their probabilities: ICP from starts all over the rotations, then the mixture."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.icp import ICPSettings, clipped_cost
from gpca.reenactment.mixture import Anchor, Fits, Mixture, densities_of
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface, share_within
from gpca.rigid import inverses, rigid_motion, rotate, rotation_angle_rad, transform

# How many rotations, up to which angle (degrees), and whether about the cloud's own center or that of its frame. Where
# surface is missing, the center of what was observed is not the object's; where the start is off, the frame's is not.
SPREADS = ((48, 109.0, True), (24, 100.0, False), (24, 180.0, True))


def search_starts(observed: np.ndarray, model: np.ndarray) -> np.ndarray:
    """Return poses (n, 4, 4) of the observed points (N, 3) in the frame of the model (M, 3), the identity first."""
    center, model_center = observed.mean(axis=0), model.mean(axis=0)
    poses = [np.eye(4)[None]]
    for count, largest_deg, about_center in SPREADS:
        R_n = rotations(count, largest_deg)
        shift_n = model_center - np.stack([rotate(R, center) for R in R_n]) if about_center else np.zeros((len(R_n), 3))
        poses.append(rigid_motion(R_n, shift_n))
    return np.concatenate(poses)


@cache
def rotations(count: int, largest_deg: float) -> np.ndarray:
    """Return about so many rotations (n, 3, 3) of at most an angle, spread evenly (super-Fibonacci, Alexa 2022)."""
    largest = np.deg2rad(largest_deg)
    share = (largest - np.sin(largest)) / np.pi  # of all rotations
    n = round(count / share)
    i = np.arange(n) + 0.5
    inner, outer = np.sqrt(i / n), np.sqrt(1 - i / n)
    first, second = 2 * np.pi * i / 2**0.5, 2 * np.pi * i / 1.533751168755204288118041
    quaternions = inner * np.sin(first), inner * np.cos(first), outer * np.sin(second), outer * np.cos(second)
    spread = Rotation.from_quat(np.column_stack(quaternions))
    return spread.as_matrix()[spread.magnitude() <= largest]


# Points of the observed cloud and of the model that ICP sees from all starts, and the mixture from the best ends.
SEARCHED, SEARCHED_MODEL = 128, 256
FITTED, FITTED_MODEL = 256, 512
WIDE, NARROW = ICPSettings("point_to_point", 0.25, 12), ICPSettings("point_to_point", 0.10, 20)
ENDS, MOST_COMPARED = 12, 70  # ends that are kept, and of how many, the best by their cost
ITERATIONS, LAST_ITERATIONS = 12, 30  # of the mixture
SAME = 0.012  # diameters; poses of the surface that are no farther apart are one hypothesis
CLOSE = 3e-3  # entries of matrices that differ no more are the same without looking at the surface
INDEPENDENT = 30  # points that the likelihood counts as: the mixture is no exact model
NEGLIGIBLE = 4.5  # nats below the best hypothesis
LEAST_COVERED = 0.2  # share of the model
FEWEST_INLIERS = 8


Evidence = Callable[[np.ndarray, float], float]  # pose (4×4), width of the normals -> nats of the posterior


@dataclass(frozen=True)
class Hypothesis:
    """A pose that may be the true one."""

    T: np.ndarray  # 4×4, takes what was observed, before the registration, to the model
    inlier_N: np.ndarray  # probability of each observed point to be no outlier
    log_likelihood: float  # mean over the points, nats
    width: float  # of the mixture's normals, diameters per axis
    covered: float  # share of the model that was observed, at most
    log_posterior: float  # tempered, up to a constant
    lone_N: np.ndarray  # probability of each observed point to lie on surface that the model lacks


def find_hypotheses(
    observed: np.ndarray,
    surface: ModelSurface,
    T_found_n: np.ndarray,
    settings: ReenactmentSettings,
    random: np.random.Generator,
    evidence: Evidence | None = None,
) -> list[Hypothesis]:
    """Return the probable hypotheses, the best first."""
    few, few_model = observed[np.sort(random.permutation(len(observed))[:FITTED])], surface.points[:FITTED_MODEL]
    few_spacing = surface.spacing * np.sqrt(len(surface.points) / len(few_model))
    some = few, Mixture(few_model, few_spacing / 2), ITERATIONS, densities_of(few, few_model)
    mixture, densities = Mixture(surface.points, surface.spacing / 2), densities_of(observed, surface.points)
    every = observed, mixture, LAST_ITERATIONS, densities

    def fit(fitted: tuple[np.ndarray, Mixture, int, np.ndarray], T_n: np.ndarray, **options: Any) -> list[Hypothesis]:
        points, mixture, iterations, densities = fitted
        fits = mixture.fit(points, T_n, iterations, densities=densities, **options)
        return [hypothesis(fits, i, points) for i in range(len(T_n))]

    def hypothesis(fits: Fits, i: int, points: np.ndarray) -> Hypothesis:
        T, matched_N, lone_N, width = fits.T_n[i], fits.inlier_n_N[i], fits.lone_n_N[i], float(fits.width_n[i])
        seen = transform(T, points)
        if (matched_N > 0.5).sum() >= FEWEST_INLIERS:
            seen = seen[matched_N > 0.5]
        # The width is that of the noise and of the gaps between the model's points.
        covered = share_within(surface.points, seen, 0.7 * width, random)
        # Points of the part that was seen are the denser, the smaller it is.
        denser = float(np.log1p(matched_N * (1 / max(covered, LEAST_COVERED) - 1)).mean())
        likelihood = float(fits.log_likelihood_n[i])
        log_posterior = min(len(points), INDEPENDENT) * (likelihood + denser) + log_prior(T, settings)
        if evidence is not None:
            log_posterior += evidence(T, width)
        return Hypothesis(T, matched_N + lone_N, likelihood, width, covered, float(log_posterior), lone_N)

    free = fit(some, search_ends(observed, surface, T_found_n, random))
    held = fit(some, np.eye(4)[None], anchor=anchor_of(len(few), settings))
    first = most_probable([*free, *held], surface, settings.hypotheses, SAME)
    # On all points, the normals start as wide as they were, which leaves fewer partners.
    T_n, width_n = (np.array([getattr(each, name) for each in first]) for name in ("T", "width"))
    found = fit(every, T_n, width_n=width_n)
    found += fit(every, np.eye(4)[None], anchor=anchor_of(len(observed), settings), width_n=np.array([held[0].width]))
    return not_negligible(most_probable(found, surface, settings.hypotheses, SAME / 2))


def most_probable(hypotheses: list[Hypothesis], surface: ModelSurface, most: int, limit: float) -> list[Hypothesis]:
    """Return the most probable distinct hypotheses, the best first."""
    ranked = sorted(hypotheses, key=lambda hypothesis: -hypothesis.log_posterior)
    rows = distinct_rows(surface, np.stack([hypothesis.T for hypothesis in ranked]), most, limit)
    return [ranked[row] for row in rows]


def not_negligible(ranked: list[Hypothesis], nats: float = NEGLIGIBLE) -> list[Hypothesis]:
    """Return the hypotheses, the best first, without those that are so many nats below it."""
    least = ranked[0].log_posterior - nats
    return [hypothesis for hypothesis in ranked if hypothesis.log_posterior > least]


def weights_of(hypotheses: Iterable[Hypothesis]) -> np.ndarray:
    """Return the probabilities (K,) of the hypotheses, which add up to 1."""
    posterior_K = np.array([hypothesis.log_posterior for hypothesis in hypotheses])
    weight_K = np.exp(posterior_K - posterior_K.max())
    return weight_K / weight_K.sum()


def anchor_of(points: int, settings: ReenactmentSettings) -> Anchor:
    """Return what holds a pose to the initial one, as firmly as is believed of good starts, against so many points."""
    rotation_rad = np.deg2rad(settings.good_rotation_deg) / np.sqrt(3)
    return Anchor(rotation_rad, settings.good_translation / np.sqrt(3), max(points / INDEPENDENT, 1.0))


def fits_at(T_n: np.ndarray, observed: np.ndarray, surface: ModelSurface) -> Fits:
    """Return what the mixture says of poses (n, 4, 4) that stay: only widths and shares of outliers are estimated."""
    mixture, densities = Mixture(surface.points, surface.spacing / 2), densities_of(observed, surface.points)
    return mixture.fit(observed, T_n, LAST_ITERATIONS, moving=False, densities=densities)


def search_ends(
    observed: np.ndarray, surface: ModelSurface, T_found_n: np.ndarray, random: np.random.Generator
) -> np.ndarray:
    """Return distinct poses (n, 4, 4) that ICP finds from all starts."""
    few = observed[np.sort(random.permutation(len(observed))[:SEARCHED])]
    few_model = surface.points[:SEARCHED_MODEL]
    known_n = np.concatenate([np.eye(4)[None], T_found_n])
    starts_n = np.concatenate([search_starts(few, few_model), T_found_n])
    near_n, _, _ = BatchedICP(few_model, WIDE).register(few, starts_n)
    near_n = near_n[first_of_alike(near_n)]
    ends_n, fitness_n, rmse_n = BatchedICP(few_model, NARROW).register(few, np.concatenate([near_n, known_n]))
    cost_n = clipped_cost(fitness_n, rmse_n, NARROW.correspondence_distance)
    best_n = np.argsort(cost_n, kind="stable")[:MOST_COMPARED]
    return ends_n[best_n][distinct_rows(surface, ends_n[best_n], ENDS, 2 * SAME)]


def log_prior(T: np.ndarray, settings: ReenactmentSettings) -> float:
    """Return the logarithm of how probable a pose error is beforehand, up to a constant."""
    angle, length = rotation_angle_rad(T), float(np.sqrt(np.square(T[:3, 3]).sum()))

    def log_normal(rotation_deg: float, translation: float) -> float:  # root mean squares over three axes
        return -1.5 * ((angle / np.deg2rad(rotation_deg)) ** 2 + (length / translation) ** 2)

    good = np.log(settings.good_starts) + log_normal(settings.good_rotation_deg, settings.good_translation)
    bad = np.log(1 - settings.good_starts) + log_normal(settings.bad_rotation_deg, settings.bad_translation)
    lost = np.log(settings.lost_starts) if settings.lost_starts else -np.inf
    return float(np.logaddexp(np.logaddexp(good, bad), lost))


def first_of_alike(T_n: np.ndarray) -> np.ndarray:
    """Return which poses (n,) of (n, 4, 4) have none before them whose matrix is the same up to `CLOSE`."""
    apart_n_n = np.abs(T_n[:, None] - T_n).max(axis=(2, 3))
    return ~np.tril(apart_n_n <= CLOSE, -1).any(axis=1)


def distinct_rows(surface: ModelSurface, T_n: np.ndarray, most: int, limit: float) -> list[int]:
    """Return the rows of the first poses (n, 4, 4) that put the surface elsewhere than all before them."""
    chosen: list[int] = []
    back_n = inverses(T_n)
    for i, T in enumerate(T_n):
        if len(chosen) == most:
            break
        alike = chosen and (np.abs(T - T_n[chosen]).max(axis=(1, 2)) <= CLOSE).any()
        if not (alike or (chosen and (surface.apart(T @ back_n[chosen]) <= limit).any())):
            chosen.append(i)
    return chosen
