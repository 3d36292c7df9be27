"""Descriptors of registered pairs in groups, their files, what has to be seen for each, and samples to learn from."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import TypeVar

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import icp_to
from gpca.alignment.icp import ICPSettings, clipped_cost
from gpca.alignment.pose_error import displacements
from gpca.causes.dataset import LABELS, Causes
from gpca.causes.settings import DENSITIES, GROUPS, MOTION, QUANTILES, REMEDIED, DescriptorSettings
from gpca.causes.truth import SUBSETS, capped, shapley_values
from gpca.io.arrays import TEXT, WHOLE
from gpca.io.container import Container, array
from gpca.pairs.dataset import Registrations
from gpca.pairs.distances import ENTROPY, ObservedPair, describe_distances, describe_entropy
from gpca.pairs.perturbation import NOISE, OVERLAP, POSE
from gpca.process.progress import progress
from gpca.rigid import exp, inverse, inverses, log, scale_translation
from gpca.seeds import generator
from gpca.uncertainty.interventions import denoise


def describe_remedied(pair: ObservedPair, settings: DescriptorSettings, icp: ICPSettings) -> np.ndarray:
    """Return `REMEDIED`: v̂ by subset of the causes left alone and its Shapley values; how far the best result moves the
    observed cloud, its cost (squared diameters) and fitness; the share of outliers, and how far denoising smooths."""
    observed = pair.observed[generator(*pair.axes, "remedies").permutation(len(pair.observed))]
    cleaned, model = denoise(observed), pair.model[: settings.icp_points]
    random = generator(*pair.axes, "restarts")
    near_k_6, far_k_6 = settings.twists(*(random.normal(size=(n, 6)) for n in (settings.starts, settings.restarts)))
    near_k_6[0] = far_k_6[0] = 0
    near_k, far_k = exp(near_k_6) @ pair.T_init, exp(far_k_6) @ pair.T_init
    counted, best_8, cost_8, fitness_8 = [], [], [], []
    for alone in SUBSETS:
        cloud = (observed if NOISE in alone else cleaned)[: settings.icp_points]
        starts_k = near_k if POSE in alone else far_k
        if OVERLAP in alone:  # the model is aligned to the observed cloud, as the registration did
            T_k, fitness_k, rmse_k = icp_to(cloud, icp).register(model, inverses(starts_k))
            T_k = inverses(T_k)
        else:
            T_k, fitness_k, rmse_k = icp_to(model, icp).register(cloud, starts_k)
        cost_k = clipped_cost(fitness_k, rmse_k, icp.correspondence_distance)
        best = cost_k.argmin()
        counted.append(T_k if POSE in alone else T_k[[best]])
        best_8.append(T_k[best])
        cost_8.append(cost_k[best])
        fitness_8.append(fitness_k[best])
    back = inverse(best_8[0])  # with all remedies
    error_8 = np.array([capped(displacements(T_k @ back, observed)).mean() for T_k in counted])
    smoothed = np.sqrt(np.square(cKDTree(cleaned).query(observed)[0]).mean())
    phi_3, moved_8 = shapley_values(error_8[None])[0], displacements(np.array(best_8), observed)
    return np.concatenate([error_8, phi_3, moved_8, cost_8, fitness_8, [1 - len(cleaned) / len(observed), smoothed]])


SPREAD_FLOOR = 1e-4  # of the spread's variances, as in the truth (docs/causes.md)
SMALLEST_COST = 1e-9  # squared diameters
QUARTERS = (0.25, 0.5, 0.75, 1.0)
ENDS = (0.0, 0.5, 1.0)
STARTS = (
    *("cost", "best_cost", "gain", "log_gain", "to_best", "mean_displacement"),
    *(f"displacement_{quantile:g}" for quantile in QUARTERS),
    "cost_deviation",
    *(f"fitness_{quantile:g}" for quantile in ENDS),
    *(f"inlier_rmse_{quantile:g}" for quantile in ENDS),
)

Columns = Mapping[str, slice | list[int]]  # group -> those of its columns
EVERY = slice(None)
EVERYTHING: Columns = dict.fromkeys(GROUPS, EVERY)
# Every other quantile of the three distances, and all of the motion.
RESIDUALS: Columns = {"distances": slice(0, 3 * QUANTILES, 2), "motion": EVERY}

_QUICK = {"outliers", "smoothed"} | {
    # The errors of the others are relative to the result with all remedies, a restart among them.
    *(f"{what}_{i}" for what in ("moved", "cost", "fitness") for i, alone in enumerate(SUBSETS) if POSE in alone)
}
COLUMNS: Mapping[str, Columns] = {
    # The observed cloud's thickness, spacing, extent and number of points.
    "source": {"distances": slice(3 * QUANTILES, None), "planes": DENSITIES[::2]},
    "pair": {"distances": EVERY, "planes": EVERY, "entropy": EVERY, "motion": slice(3, 5)},  # how well it fits
    "motion": {"motion": slice(0, 3)},
    "runs": {"motion": slice(5, None), "starts": EVERY},  # the spread
    "quick_remedies": {"remedied": [column for column, name in enumerate(REMEDIED) if name in _QUICK]},
    "remedies": {"remedied": EVERY},
}


@dataclass(frozen=True)
class Descriptors(Container):
    """The descriptors of S registrations in groups; see the functions that describe them."""

    sample: np.ndarray = array("S", WHOLE)
    split: np.ndarray = array("S", TEXT)
    distances: np.ndarray = array(f"S {4 * QUANTILES}")
    planes: np.ndarray = array(f"S {3 * QUANTILES + len(DENSITIES)}")
    motion: np.ndarray = array(f"S {len(MOTION)}")
    starts: np.ndarray = array(f"S {len(STARTS)}")
    remedied: np.ndarray = array(f"S {len(REMEDIED)}")
    entropy: np.ndarray = array(f"S {len(ENTROPY)}")

    @property
    def groups(self) -> dict[str, np.ndarray]:
        """The descriptors (S, F) by group."""
        return {name: getattr(self, name) for name in GROUPS}


WIDTHS = {name: int(Descriptors.array_fields()[name].shape[1]) for name in GROUPS}


def observed_pair(causes: Causes, row: int, *axes: object) -> ObservedPair:
    """Return what may be seen of a row; its draws are named by the axes, its split and its number."""
    registrations, diameter_m = causes.registrations, causes.registrations.diameter_m[row]
    T_back = inverse(registrations.T_target_source("icp", row))
    runs_n = [scale_translation(T, 1 / diameter_m) @ T_back for T in causes.T_target_source_runs[row]]
    return ObservedPair(
        observed=registrations.cloud(row).astype(np.float64),
        model=registrations.target(row).astype(np.float64),
        T_init=registrations.T_target_source("init", row) @ T_back,
        T_runs=np.array(runs_n),
        fitness_n=causes.fitness_runs[row],
        inlier_rmse_n=causes.inlier_rmse_runs[row],
        axes=(*axes, registrations.split[row], registrations.sample[row]),
    )


def describe_motion(pair: ObservedPair) -> np.ndarray:
    """Return the numbers of :data:`gpca.causes.settings.MOTION`, in radians and diameters."""
    covariance = np.cov(log(pair.T_runs), rowvar=False)
    moved_2 = np.sqrt(np.square(log(inverse(pair.T_init)[None])[0]).reshape(2, 3).sum(axis=1))  # rotation, translation
    spread_2 = np.sqrt(np.diag(covariance).reshape(2, 3).sum(axis=1))
    displacement = displacements(pair.T_init[None], pair.observed)[0]
    log_determinant = np.linalg.slogdet(covariance + SPREAD_FLOOR * np.eye(6))[1]
    return np.array([*moved_2, displacement, pair.fitness_n[0], pair.inlier_rmse_n[0], *spread_2, log_determinant])


def describe_starts(pair: ObservedPair, icp: ICPSettings) -> np.ndarray:
    """Return `STARTS`: whether another start ends elsewhere, and fits better there."""
    cost_n = pair.cost_n(icp)
    best = cost_n.argmin()
    moved_n = displacements(pair.T_runs, pair.observed)
    log_gain = np.log(max(cost_n[0], SMALLEST_COST) / max(cost_n[best], SMALLEST_COST))
    costs = (cost_n[0], cost_n[best], cost_n[0] - cost_n[best], log_gain)
    moved = (moved_n[best], moved_n.mean(), *np.quantile(moved_n, QUARTERS))
    fits = (*np.quantile(pair.fitness_n, ENDS), *np.quantile(pair.inlier_rmse_n, ENDS))
    return np.array([*costs, *moved, cost_n.std(), *fits])


def describe_plainly(pair: ObservedPair, icp: ICPSettings) -> dict[str, np.ndarray]:
    """Return the groups of a pair that are quick to measure: distances, planes, motion and starts."""
    distances, planes = describe_distances(pair)
    motion, starts = describe_motion(pair), describe_starts(pair, icp)
    return {"distances": distances, "planes": planes, "motion": motion, "starts": starts}


def describe(pair: ObservedPair, settings: DescriptorSettings, icp: ICPSettings) -> tuple[dict[str, np.ndarray], float]:
    """Return every group of a pair, and the seconds that its registrations with remedies took."""
    described = describe_plainly(pair, icp) | {"entropy": describe_entropy(pair)}
    started = perf_counter()
    described["remedied"] = describe_remedied(pair, settings, icp)
    return described, perf_counter() - started


def describe_all(
    causes: Causes, source: str, seed: int, settings: DescriptorSettings, icp: ICPSettings
) -> tuple[Descriptors, np.ndarray, np.ndarray]:
    """Return the descriptors of every row, the seconds (S,) that each took, and those of its registrations."""
    rows, seconds, icp_seconds = [], [], []
    for row in progress(range(len(causes)), f"descriptors of {source}, seed {seed}"):
        started = perf_counter()
        described, remedies = describe(observed_pair(causes, row, source, seed, "descriptors"), settings, icp)
        rows.append(described)
        seconds.append(perf_counter() - started)
        icp_seconds.append(remedies)
    shown, groups = causes.registrations, {name: np.array([described[name] for described in rows]) for name in GROUPS}
    return Descriptors(shown.sample, shown.split, **groups, axes=shown.axes), np.array(seconds), np.array(icp_seconds)


def seen(arrays: Mapping[str, np.ndarray], sees: Collection[str], wanted: Columns = EVERYTHING) -> np.ndarray:
    """Return those wanted columns of the arrays (N, F) that these keys of `COLUMNS` show, in the order of `GROUPS`."""
    chosen = []
    for group in (name for name in GROUPS if name in wanted):
        array_N_F = arrays[group]
        numbers_F = np.arange(array_N_F.shape[1])
        shown = [numbers_F[COLUMNS[part][group]] for part in sees if group in COLUMNS[part]]
        if shown:
            chosen.append(array_N_F[:, np.intersect1d(numbers_F[wanted[group]], np.concatenate(shown))])
    return np.hstack(chosen)


QUICK = ("distances", "planes", "motion", "starts")  # groups of descriptors that need no further registration


@dataclass(frozen=True)
class LabeledSamples(Container):
    """N labeled registrations, nominal or with the dominant cause: the `QUICK` groups of descriptors (N, F)."""

    distances: np.ndarray = array(f"N {WIDTHS['distances']}")
    planes: np.ndarray = array(f"N {WIDTHS['planes']}")
    motion: np.ndarray = array(f"N {WIDTHS['motion']}")
    starts: np.ndarray = array(f"N {WIDTHS['starts']}")
    concept: np.ndarray = array("N", TEXT, choices=LABELS)
    cluster: np.ndarray = array("N", TEXT)  # the family

    @classmethod
    def of(cls, registrations: Registrations) -> LabeledSamples:
        """Return the labels and quick descriptors of registrations that have both."""
        groups = {name: registrations.attached[name] for name in QUICK}
        return cls(**groups, concept=registrations.concept, cluster=registrations.cluster, axes=None)

    @property
    def attached(self) -> Mapping[str, np.ndarray]:
        """The groups by name, as explainers read them."""
        return {name: getattr(self, name) for name in QUICK}

    @property
    def features(self) -> np.ndarray:
        """All groups side by side (N, F)."""
        return np.hstack([*self.attached.values()])


Samples = TypeVar("Samples", Registrations, LabeledSamples)


def joined_without(families: Sequence[str] | np.ndarray, parts: Iterable[Samples]) -> Samples:
    """Return the samples of several, but those of families that are tested."""
    tested = np.asarray(families, str)
    left = [part.subset(np.flatnonzero(~np.isin(part.cluster, tested))) for part in parts]
    return left[0] if len(left) == 1 else type(left[0]).joined(left)
