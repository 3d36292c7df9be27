"""Counterfactuals that anyone can make of their own registration: it is run again with remedies.

The observed cloud is denoised, ICP starts from farther off and the best result counts, or the observed cloud is
aligned to the model, in which it finds partners everywhere however much of it is missing. The truth is not
known; the result with all three remedies stands for it. So v̂ of a subset of the causes, those that are left alone, is
how far the results with the other remedies lie from that, as v of the truth is the error without the other causes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.icp import ICPSettings, clipped_cost
from gpca.alignment.pose_error import displacements
from gpca.alignment.rigid import exp, inverse, inverses
from gpca.causes.settings import DescriptorSettings
from gpca.causes.shapley import SUBSETS, shapley_values
from gpca.causes.truth import LARGEST_ERROR
from gpca.pairs.distances import ObservedPair
from gpca.pairs.perturbation import NOISE, OVERLAP, POSE
from gpca.seeds import generator
from gpca.uncertainty.remedies import denoise


def describe_remedied(pair: ObservedPair, settings: DescriptorSettings, icp: ICPSettings) -> np.ndarray:
    """Return the numbers of :data:`gpca.causes.settings.REMEDIED`.

    For each subset of the causes that are left alone: v̂ in diameters; after the Shapley values of v̂, how far the best
    result moves the observed cloud from where it lies, and the best result's cost (squared diameters) and fitness.
    Last, the share of the points that denoising takes for outliers, and how far it smooths.
    """
    observed = pair.observed[generator(*pair.axes, "remedies").permutation(len(pair.observed))]
    cleaned = denoise(observed)
    starts = _starts(pair, settings)
    model = pair.model[: settings.icp_points]
    results = []
    for present in SUBSETS:
        cloud = (observed if NOISE in present else cleaned)[: settings.icp_points]
        onto_observed = OVERLAP in present
        results.append(_register(cloud, model, starts[POSE in present], onto_observed, icp))
    truth = results[0].best
    error_8 = np.array(
        [
            results[0].best_error(truth, observed),
            *(
                result.mean_error(truth, observed) if POSE in present else result.best_error(truth, observed)
                for present, result in zip(SUBSETS[1:], results[1:], strict=True)
            ),
        ]
    )
    return np.concatenate(
        [
            error_8,
            shapley_values(error_8[None])[0],
            displacements(np.array([result.best for result in results]), observed),
            [result.cost_n.min() for result in results],
            [result.fitness_n[result.cost_n.argmin()] for result in results],
            [1 - len(cleaned) / len(observed)],
            [np.sqrt(np.square(cKDTree(cleaned).query(observed)[0]).mean())],
        ]
    )


@dataclass(frozen=True)
class _Results:
    """Poses (n, 4, 4) of the observed cloud relative to where ICP put it, with cost and fitness (n,)."""

    T_n: np.ndarray
    cost_n: np.ndarray
    fitness_n: np.ndarray

    @property
    def best(self) -> np.ndarray:
        return self.T_n[self.cost_n.argmin()]

    def mean_error(self, truth: np.ndarray, points: np.ndarray) -> float:
        return float(_errors(self.T_n, truth, points).mean())

    def best_error(self, truth: np.ndarray, points: np.ndarray) -> float:
        return float(_errors(self.best[None], truth, points)[0])


def _errors(T_n: np.ndarray, truth: np.ndarray, points: np.ndarray) -> np.ndarray:
    return np.minimum(displacements(T_n @ inverse(truth), points), LARGEST_ERROR)


def _starts(pair: ObservedPair, settings: DescriptorSettings) -> dict[bool, np.ndarray]:
    """Return the starts (k, 4, 4) where the pose error is left alone, and the restart's: farther off, and more."""
    random = generator(*pair.axes, "restarts")
    near_k_6, far_k_6 = settings.twists(
        random.normal(size=(settings.starts, 6)), random.normal(size=(settings.restarts, 6))
    )
    near_k_6[0] = far_k_6[0] = 0
    return {True: exp(near_k_6) @ pair.T_init, False: exp(far_k_6) @ pair.T_init}


def _register(
    observed: np.ndarray, model: np.ndarray, starts_n: np.ndarray, onto_observed: bool, icp: ICPSettings
) -> _Results:
    """Align the model to the observed cloud, as the registration did, or the observed cloud to the model."""
    if onto_observed:
        T_n, fitness_n, rmse_n = BatchedICP(observed, icp).register(model, inverses(starts_n))
        T_n = inverses(T_n)
    else:
        T_n, fitness_n, rmse_n = BatchedICP(model, icp).register(observed, starts_n)
    return _Results(T_n, clipped_cost(fitness_n, rmse_n, icp.correspondence_distance), fitness_n)
