"""Candidates, a model and an observed cloud with any subset of the causes, and their counterfactual registrations.

A cause that is not there is small, not zero: a start is never perfect, a sensor never without noise, a surface never
whole. Without this, any trace of a cause would give away that it was applied.

All lengths are relative to the object's diameter. The observed cloud is kept in the model's frame, in which the true
pose is the identity; a pose error is where the registration starts. ICP aligns the model to the observed cloud, so that
missing surface hurts: every point of the model looks for a partner. It may be asked to run the other way
(:attr:`gpca.causes.settings.CauseSettings.moved`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from time import perf_counter

import numpy as np

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.rigid import exp, inverses, random_direction, transform
from gpca.causes.dataset import Causes
from gpca.causes.settings import FEWEST_POINTS, OBSERVED, CauseSettings, CauseSeverities
from gpca.causes.truth import ALL, NONE, SUBSETS, capped
from gpca.errors import InputError
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.perturbation import CONCEPTS, NOISE, OVERLAP, POSE, displacement, within_half_space
from gpca.seeds import generator
from gpca.uncertainty.settings import UncertaintySettings
from gpca.uncertainty.spread import Runs, divergence

CAUSE_OF = {"noise": NOISE, "outliers": NOISE, "rotation_rad": POSE, "translation": POSE, "crop": OVERLAP}


def draw_applied(settings: CauseSettings, random: np.random.Generator) -> np.ndarray:
    """Return which of the causes (3,) are applied."""
    return random.random(len(CONCEPTS)) < settings.present


@dataclass(frozen=True)
class Candidate:
    """A pair and all causes that may be applied to it.

    Attributes:
        applied: (3,) which of noise, pose and overlap are.
        model: (P, 3) points of the model.
        clean, noisy: (Q, 3) other points of the surface with a sensor's least noise, and with jitter and outliers.
        seen, kept: rows of them that a small gap leaves, and those that an occlusion leaves.
        T_near, T_init: 4×4, where a good start is, and where a pose error starts: they take what was observed to a
            wrong place in the model's frame.
        severity: by name; small where not applied.
        model_at_truth: (P, 3) the model where no pose error is, if it is rendered where the registration starts; None
            where it is the same everywhere.
        toward_hidden: (3,) unit vector along which the surface was cut off; None where no half-space has cut it.
    """

    applied: np.ndarray
    model: np.ndarray
    clean: np.ndarray
    noisy: np.ndarray
    seen: np.ndarray
    kept: np.ndarray
    T_near: np.ndarray
    T_init: np.ndarray
    severity: dict[str, float]
    model_at_truth: np.ndarray | None = None
    toward_hidden: np.ndarray | None = None

    def observed(self, causes: tuple[int, ...]) -> np.ndarray:
        """Return the observed cloud with these of the applied causes."""
        points = self.noisy if NOISE in causes else self.clean
        return points[self.kept if OVERLAP in causes else self.seen]

    def reference(self, causes: tuple[int, ...]) -> np.ndarray:
        """Return the model's points that a registration with these of the applied causes is given."""
        return self.model if POSE in causes or self.model_at_truth is None else self.model_at_truth

    def changing_reference(self, causes: tuple[int, ...]) -> tuple[int, ...]:
        """Return those of the causes that change :meth:`reference`: where they are the same, so are its points."""
        return () if self.model_at_truth is None else tuple(cause for cause in causes if cause == POSE)

    def start(self, causes: tuple[int, ...]) -> np.ndarray:
        """Return the pose, 4×4, that a registration with these of the applied causes starts from."""
        return self.T_init if POSE in causes else self.T_near


def draw_candidate(
    surface: np.ndarray, applied: np.ndarray, settings: CauseSettings, random: np.random.Generator
) -> Candidate:
    """Draw the points and the severities of a candidate.

    What is small where a cause is not applied is the same perturbation with a smaller severity: along the same axes,
    away from the same side. The number of points is that of what remains, so that it tells nothing about the surface
    that is missing.

    Args:
        surface: (N, 3) points of the object, of which model and observation take different ones.
        applied: (3,) of :func:`draw_applied`.
    """
    fewest, most = settings.points
    counts = np.exp(random.uniform(np.log(fewest), np.log(most), size=2)).round().astype(int)
    strong, small = (_severities(ranges, random) for ranges in (settings.severities, settings.small.ranges()))
    severity = {name: (strong if applied[cause] else small)[name] for name, cause in CAUSE_OF.items()}
    n_model, n_seen = np.minimum(counts, len(surface) // 2)
    n_observed = min(round(n_seen / (1 - severity["crop"])), len(surface) - n_model)
    order = random.permutation(len(surface))
    model, points = surface[order[:n_model]], surface[order[n_model : n_model + n_observed]]
    jitter = random.normal(size=points.shape)
    anywhere = random.uniform(-0.5, 0.5, size=points.shape)
    is_outlier = random.random(len(points)) < strong["outliers"]
    toward_hidden = random_direction(random)
    along = points @ toward_hidden
    axis, direction = random_direction(random), random_direction(random)
    seen, kept = (within_half_space(along, level["crop"], FEWEST_POINTS) for level in (small, strong))
    T_near, T_init = (
        displacement(level["rotation_rad"] * axis, level["translation"] * direction) for level in (small, strong)
    )
    return Candidate(
        applied=applied,
        model=model,
        clean=points + small["noise"] * jitter,
        noisy=np.where(is_outlier[:, None], anywhere, points + strong["noise"] * jitter),
        seen=seen,
        kept=kept,
        T_near=T_near,
        T_init=T_init,
        severity=severity,
        toward_hidden=toward_hidden,
    )


def redrawn(candidate: Candidate, surface: np.ndarray, random: np.random.Generator) -> Candidate:
    """Return a candidate without causes once more: as many other points, with the same severities and start."""
    rows = random.permutation(len(surface))[: len(candidate.model) + len(candidate.clean)]
    model, points = np.split(surface[rows], [len(candidate.model)])
    clean = points + candidate.severity["noise"] * random.normal(size=points.shape)
    seen = within_half_space(points @ candidate.toward_hidden, candidate.severity["crop"], FEWEST_POINTS)
    return replace(candidate, model=model, clean=clean, seen=seen)


def _severities(ranges: CauseSeverities, random: np.random.Generator) -> dict[str, float]:
    drawn = {part.name: random.uniform(*getattr(ranges, part.name)) for part in fields(ranges)}
    return drawn | {"rotation_rad": float(np.deg2rad(drawn.pop("rotation_deg")))}


class Unmeasurable(Exception):
    """A candidate has no truth; the text says why."""


class Registrar:
    """Registers one candidate from any starts; what several calls share is computed once.

    Args:
        misses: whether runs may all find no correspondence, and so stay where they started; else that is refused.
    """

    def __init__(self, candidate: Candidate, settings: CauseSettings, misses: bool = False) -> None:
        self.candidate = candidate
        self._settings = settings
        self._misses = misses
        self._targets: dict[tuple[int, ...], BatchedICP] = {}

    def run(self, causes: tuple[int, ...], xi_n_6: np.ndarray) -> Runs:
        """Register with these causes from the starts exp(ξ) T_init.

        Returns:
            the runs, whose poses take what was observed to the model: the identity is right. The inlier RMSE of a run
            without any correspondence is the correspondence distance: 0 would be the best there is.

        Raises:
            Unmeasurable: no run found a correspondence, unless that is allowed, or a pose is not finite.
        """
        starts_n = exp(xi_n_6) @ self.candidate.start(causes)
        observed, model = self.candidate.observed(causes), self.candidate.reference(causes)
        started = perf_counter()
        if self._settings.moved == OBSERVED:
            changing = self.candidate.changing_reference(causes)
            poses_n, fitness_n, rmse_n = self._target(changing, model).register(observed, starts_n)
        else:
            alike = tuple(cause for cause in causes if cause != POSE)  # a pose error changes no cloud
            poses_n, fitness_n, rmse_n = self._target(alike, observed).register(model, inverses(starts_n))
            poses_n = inverses(poses_n)
        seconds = perf_counter() - started
        if not np.isfinite(poses_n).all():
            raise Unmeasurable("not finite")
        if not (fitness_n.any() or self._misses):
            raise Unmeasurable("no correspondences")
        rmse_n = np.where(fitness_n > 0, rmse_n, self._settings.icp.correspondence_distance)
        return Runs(poses_n, fitness_n, rmse_n, len(poses_n), seconds)

    def _target(self, causes: tuple[int, ...], points: np.ndarray) -> BatchedICP:
        if causes not in self._targets:
            self._targets[causes] = BatchedICP(points, self._settings.icp)
        return self._targets[causes]


class Counterfactuals:
    """The errors and uncertainties of one candidate, each measured when it is first asked for.

    Args:
        registrar: of the candidate.
        errors: of poses (n, 4, 4) of its object's points, in diameters.
        xi_n_6: twists of the starts, the same for every subset.
    """

    def __init__(
        self,
        registrar: Registrar,
        errors: Callable[[np.ndarray], np.ndarray],
        xi_n_6: np.ndarray,
        settings: UncertaintySettings,
    ) -> None:
        self._registrar = registrar
        self._errors = errors
        self._xi_n_6 = xi_n_6
        self._floor = settings.floor
        self._measured: dict[tuple[int, ...], tuple[float, np.ndarray]] = {}

    def error(self, subset: int) -> float:
        """Return v, the mean error over the starts, in diameters.

        Raises:
            Unmeasurable: see :meth:`Registrar.run`; also an error that is not finite.
        """
        return self._measure(subset)[0]

    def uncertainty(self, subset: int) -> float:
        """Return u against the clean pair, nats. Raises Unmeasurable as :meth:`error` does."""
        return float(divergence(self.covariance(NONE), self.covariance(subset), self._floor))

    def covariance(self, subset: int) -> np.ndarray:
        """Return Σ (6, 6) of the poses. Raises Unmeasurable as :meth:`error` does."""
        return self._measure(subset)[1]

    def _measure(self, subset: int) -> tuple[float, np.ndarray]:
        # What was not applied is not there to be removed: those subsets are the same registration.
        causes = tuple(cause for cause in SUBSETS[subset] if self._registrar.candidate.applied[cause])
        if causes not in self._measured:
            runs = self._registrar.run(causes, self._xi_n_6)
            # An error is that of the model's pose in what was observed.
            errors_n = capped(self._errors(inverses(runs.T_target_source_n)))
            if not np.isfinite(errors_n).all():
                raise Unmeasurable("not finite")
            self._measured[causes] = float(errors_n.mean()), runs.covariance(np.eye(4))
        return self._measured[causes]


@dataclass(frozen=True)
class Replay:
    """One sample under every subset of its causes.

    Attributes:
        model: (P, 3) in diameters.
        observed: for each of the eight subsets the observed cloud (Q, 3) where ICP put it in the model's frame.
    """

    model: np.ndarray
    observed: list[np.ndarray]


def surface_of(objects: ObjectClouds, causes: Causes, row: int) -> np.ndarray:
    """Return the points (N, 3) of a sample's object, in diameters."""
    index = int(causes.registrations.object_index[row])
    return objects.points(index).astype(np.float64) / float(objects.diameters_m[index])


def candidate_of(
    causes: Causes, row: int, surface: np.ndarray, source: str, seed: int, settings: CauseSettings
) -> Candidate:
    """Return the candidate that a sample is, drawn again from the points of its object and the same settings."""
    random = generator(source, seed, "causes", str(causes.registrations.split[row]), int(causes.candidate[row]))
    return draw_candidate(surface, draw_applied(settings, random), settings, random)


def replay(objects: ObjectClouds, causes: Causes, row: int, source: str, seed: int, settings: CauseSettings) -> Replay:
    """Return the results of ICP under each subset from the initial pose itself.

    Raises:
        InputError: the objects or the settings are not those that the sample was drawn with.
    """
    registrations = causes.registrations
    candidate = candidate_of(causes, row, surface_of(objects, causes, row), source, seed, settings)
    registrar = Registrar(candidate, settings)
    observed = []
    for present in SUBSETS:
        applied = tuple(cause for cause in present if candidate.applied[cause])
        runs = registrar.run(applied, np.zeros((1, 6)))
        observed.append(transform(runs.T_target_source_n[0], candidate.observed(applied)))
    shown = registrations.cloud(row)
    if shown.shape != observed[ALL].shape or np.abs(observed[ALL] - shown).max() > 1e-3:
        fault = "is not reproduced by these settings"
        raise InputError(
            f"sample {registrations.sample[row]} of {source}", fault, "regenerate the causes from a single config"
        )
    return Replay(candidate.model, observed)
