"""Counterfactuals of one candidate: it is registered again with every subset of its causes, from the same starts.

ICP aligns the model to the observed cloud, so that missing surface hurts: every point of the model looks for a partner.
It may be asked to run the other way (:attr:`gpca.causes.settings.CauseSettings.moved`).

For pictures, :func:`replay` draws a sample's candidate again and registers it without starts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.rigid import exp, inverses, transform
from gpca.causes.candidate import Candidate, draw_applied, draw_candidate
from gpca.causes.dataset import Causes
from gpca.causes.settings import OBSERVED, CauseSettings
from gpca.causes.shapley import ALL, NONE, SUBSETS
from gpca.causes.truth import capped
from gpca.errors import InputError
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.perturbation import POSE
from gpca.seeds import generator
from gpca.uncertainty.settings import UncertaintySettings
from gpca.uncertainty.spread import Runs, divergence


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
