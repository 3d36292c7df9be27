"""The truth's counterfactuals under the hypotheses of an observer: v̂, û and φ̂."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter

import numpy as np

from gpca.alignment.rigid import inverse, transform
from gpca.causes.candidate import Candidate
from gpca.causes.counterfactuals import Counterfactuals, Registrar, Unmeasurable
from gpca.causes.settings import CauseSettings
from gpca.causes.shapley import SUBSETS, shapley_values
from gpca.causes.truth import LARGEST_ERROR
from gpca.pairs.distances import ObservedPair
from gpca.reenactment.hypotheses import Hypothesis, find_hypotheses
from gpca.reenactment.observation import NoiseScale, observe
from gpca.reenactment.rebuilding import rebuild
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.seeds import generator


@dataclass(frozen=True)
class Enactment:
    """One hypothesis and what the registration would have done, were it true.

    Attributes:
        candidate: what is registered; its severities are what the hypothesis says of noise, outliers and crop.
        error_8, uncertainty_8: v̂ and û of every subset of the causes, as in :class:`gpca.causes.truth.Truth`.
        icp_seconds: that the registrations took.
    """

    hypothesis: Hypothesis
    candidate: Candidate
    error_8: np.ndarray
    uncertainty_8: np.ndarray
    icp_seconds: float

    @cached_property
    def phi_3(self) -> np.ndarray:
        """φ̂, what each cause adds to the error."""
        return shapley_values(self.error_8[None])[0]


def reenact(
    pair: ObservedPair, settings: ReenactmentSettings, truth: CauseSettings, surface: ModelSurface | None = None
) -> list[Enactment]:
    """Find hypotheses of the true pose and enact each, the most probable first.

    Args:
        truth: how the truth's counterfactuals are registered; what it says of candidates is not read.
        surface: that of the model, where it is known already.
    """
    surface = surface or ModelSurface(pair.model)
    before = transform(pair.T_init, pair.observed)
    T_found_n = pair.T_runs @ inverse(pair.T_init)
    random = generator(*pair.axes, "hypotheses")
    hypotheses = find_hypotheses(before, surface, T_found_n, settings, random)
    xi_n_6 = start_twists(pair.axes, truth)
    scale = NoiseScale(surface, random)
    return [enact(before, hypothesis, surface, scale, xi_n_6, truth, random) for hypothesis in hypotheses]


def enact(
    before: np.ndarray,
    hypothesis: Hypothesis,
    surface: ModelSurface,
    scale: NoiseScale,
    xi_n_6: np.ndarray,
    truth: CauseSettings,
    random: np.random.Generator,
) -> Enactment:
    """Register every subset of the causes from the same starts, as if a hypothesis were true."""
    observation = observe(before, hypothesis, surface, scale, random)
    candidate = rebuild(hypothesis.T, observation, surface, random)
    return register(hypothesis, candidate, surface.errors, xi_n_6, truth)


def register(
    hypothesis: Hypothesis,
    candidate: Candidate,
    errors: Callable[[np.ndarray], np.ndarray],
    xi_n_6: np.ndarray,
    truth: CauseSettings,
    misses: bool = False,
) -> Enactment:
    """Register every subset of a candidate's causes; what cannot be registered is as wrong as can be.

    Args:
        errors, misses: as for :class:`gpca.causes.counterfactuals.Counterfactuals` and its registrar.
    """
    started = perf_counter()
    measured = Counterfactuals(Registrar(candidate, truth, misses), errors, xi_n_6, truth)
    error_8, uncertainty_8 = np.array([_measured(measured, subset) for subset in range(len(SUBSETS))]).T
    return Enactment(hypothesis, candidate, error_8, uncertainty_8, perf_counter() - started)


def start_twists(axes: tuple, truth: CauseSettings) -> np.ndarray:
    """Return the twists (n, 6) of the starts around the initial pose, the same for every subset and hypothesis.

    Args:
        axes: name the random numbers of the registration.
    """
    return generator(*axes, "starts").normal(size=(truth.starts, 6)) * truth.deviation_6()


def _measured(measured: Counterfactuals, subset: int) -> tuple[float, float]:
    try:
        return measured.error(subset), measured.uncertainty(subset)
    except Unmeasurable:
        return LARGEST_ERROR, 0.0
