"""A drill, a can and what a camera might see of them, as a registration finds it."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.candidate import Registrar, draw_candidate
from gpca.causes.settings import CauseSettings, CauseSeverities
from gpca.pairs.distances import ObservedPair
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import inverse, transform

STRONG = CauseSeverities(
    noise=(0.06, 0.06), outliers=(0.03, 0.03), rotation_deg=(100, 100), translation=(0.2, 0.2), crop=(0.6, 0.6)
)
TRUTH = CauseSettings(points=(400, 400), severities=STRONG)


@pytest.fixture(scope="session")
def drill(four):
    return surface_of(four, "035_power_drill")


@pytest.fixture(scope="session")
def can(four):
    return surface_of(four, "002_master_chef_can")


def surface_of(objects, name):
    index = objects.row(name)
    return objects.points(index).astype(float) / objects.diameters_m[index]


@pytest.fixture(scope="session")
def model(drill):
    return ModelSurface(drill[:400])


def without_truth(causes):
    """The same rows without anything that only the truth knows."""
    blank = {name: np.zeros_like(getattr(causes, name)) for name in ("applied", "severity_outliers", "error_shown")}
    unknown = replace(causes.truth, error=causes.truth.error * np.nan, uncertainty=causes.truth.uncertainty * np.nan)
    registrations = causes.registrations.without_labels()
    assert np.isnan(registrations.T_target_source_true).all()
    return replace(causes, registrations=registrations, truth=unknown, truth_again=unknown, **blank)


def candidate_of(surface, *causes, seed=100, settings=TRUTH):
    applied = np.array([concept in causes for concept in CONCEPTS])
    return draw_candidate(surface, applied, settings, np.random.default_rng(seed))


def pair_of(candidate, seed=100, settings=TRUTH):
    """The pair that a registration with all causes leaves, and the true pose of what was observed before it."""
    causes = tuple(np.flatnonzero(candidate.applied).tolist())
    xi = np.random.default_rng(seed).normal(size=(13, 6)) * settings.deviation_6()
    xi[0] = 0
    runs = Registrar(candidate, settings).run(causes, xi)
    T_result, T_start = runs.T_target_source_n[0], candidate.start(causes)
    pair = ObservedPair(
        observed=transform(T_result, candidate.observed(causes)),
        model=candidate.model,
        T_init=T_start @ inverse(T_result),
        T_runs=runs.T_target_source_n @ inverse(T_result),
        fitness_n=runs.fitness_n,
        inlier_rmse_n=runs.inlier_rmse_n,
        axes=("tiny", seed),
    )
    return pair, inverse(T_start)
