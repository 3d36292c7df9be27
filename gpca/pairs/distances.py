"""What two aligned clouds tell of their registration: distances, local planes, entropies of the joint cloud."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.icp import ICPSettings, clipped_cost
from gpca.alignment.pose_error import displacements
from gpca.pairs.dataset import Registrations
from gpca.process.progress import progress
from gpca.rigid import dots, inverse, log
from gpca.seeds import generator

LEVELS = np.array([0.01, *np.arange(1, 12) / 12, 0.99])  # of quantiles; the very ends belong to single points
NEIGHBORS = 12  # that span a local plane
CHANNELS = 7
LEAST = 0.02  # of the model's spacing, to which lengths are raised: a flat face is not infinitely thin
RADII = (0.06, 0.12)  # diameters, of entropies: about the spacing of the sparsest clouds, and twice that
FEWEST_NEIGHBORS = 4  # below this a covariance in space is singular
ENTROPY_FLOOR = 1e-6  # squared diameters; a plane has no entropy otherwise
ENTROPY = tuple(f"{what}_{radius:g}" for radius in RADII for what in ("joint", "apart", "difference", "measured"))


@dataclass(frozen=True)
class ObservedPair:
    """The observed cloud and the model, both in the model's frame and in diameters. Poses take the observed cloud."""

    observed: np.ndarray  # (N, 3) where ICP put them
    model: np.ndarray  # (M, 3)
    T_init: np.ndarray  # 4×4, from where ICP put it back to where ICP started
    T_runs: np.ndarray  # (n, 4, 4), from there to what ICP found from other starts; the first is the identity
    fitness_n: np.ndarray  # of these runs
    inlier_rmse_n: np.ndarray
    axes: tuple  # name what is random in describing it

    def cost_n(self, icp: ICPSettings) -> np.ndarray:
        """Return the mean squared distance of each run (n,), cut off at the correspondence distance."""
        return clipped_cost(self.fitness_n, self.inlier_rmse_n, icp.correspondence_distance)


def observed_once(registrations: Registrations, row: int, points: int, random: np.random.Generator) -> ObservedPair:
    """Return the observed pair of a row, each cloud thinned to `points` points, with its one run of ICP."""
    observed, model = (
        cloud[np.sort(random.permutation(len(cloud))[:points])].astype(np.float64)
        for cloud in (registrations.cloud(row), registrations.target(row))
    )
    return ObservedPair(
        observed=observed,
        model=model,
        T_init=registrations.T_target_source("init", row) @ inverse(registrations.T_target_source("icp", row)),
        T_runs=np.eye(4)[None],
        fitness_n=registrations.fitness[[row]],
        inlier_rmse_n=registrations.inlier_rmse[[row]],
        axes=(),
    )


@dataclass(frozen=True)
class LocalPlanes:
    """A cloud with the plane around each of its points."""

    tree: cKDTree
    spacing: np.ndarray  # (N,) distance to the nearest other point
    normals: np.ndarray  # (N, 3), without a sign
    thickness: np.ndarray  # (N,) root mean square distance of the neighbors from the plane,
    extent: np.ndarray  # (N,) and along its longest axis

    @classmethod
    def of(cls, points: np.ndarray) -> LocalPlanes:
        """Return the planes of least squares through the nearest points of each point (N, 3)."""
        tree = cKDTree(points)
        neighbors = min(NEIGHBORS, len(points))
        distances_N_k, rows_N_k = tree.query(points, neighbors)
        around_N_k_3 = points[rows_N_k]
        offsets_N_k_3 = around_N_k_3 - around_N_k_3.mean(axis=1, keepdims=True)
        squares_N_3, axes_N_3_3 = np.linalg.eigh(second_moments(offsets_N_k_3))
        spread_N_3 = np.sqrt(np.maximum(squares_N_3, 0) / neighbors)
        return cls(tree, distances_N_k[:, 1], axes_N_3_3[:, :, 0], spread_N_3[:, 0], spread_N_3[:, 2])


def second_moments(offsets_N_k_3: np.ndarray) -> np.ndarray:
    """Return Σ x xᵀ (N, 3, 3), summed in one order on every processor."""
    x, y, z = np.moveaxis(offsets_N_k_3, -1, 0)
    rows = [[(a * b).sum(axis=1) for b in (x, y, z)] for a in (x, y, z)]
    return np.moveaxis(np.array(rows), -1, 0)


@dataclass(frozen=True)
class MatchedPair:
    """A pair whose points know their partners: the nearest points of the other cloud."""

    observed: LocalPlanes
    model: LocalPlanes
    partner_N: np.ndarray  # row of each point's partner in the other cloud
    partner_M: np.ndarray
    to_model_N: np.ndarray  # the distance there
    to_observed_M: np.ndarray
    plane_N: np.ndarray  # the distance from the partner's plane
    plane_M: np.ndarray
    cosine_N: np.ndarray  # |cosine| between the normals of an observed point and its partner

    @classmethod
    def of(cls, pair: ObservedPair) -> MatchedPair:
        """Find planes and partners of a pair."""
        observed, model = LocalPlanes.of(pair.observed), LocalPlanes.of(pair.model)
        to_model_N, partner_N = model.tree.query(pair.observed)
        to_observed_M, partner_M = observed.tree.query(pair.model)
        return cls(
            *(observed, model, partner_N, partner_M, to_model_N, to_observed_M),
            plane_N=np.abs(dots(pair.observed - pair.model[partner_N], model.normals[partner_N])),
            plane_M=np.abs(dots(pair.model - pair.observed[partner_M], observed.normals[partner_M])),
            cosine_N=np.abs(dots(observed.normals, model.normals[partner_N])),
        )


def describe_distances(pair: ObservedPair, matched: MatchedPair | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return the 52 distances of the pair, and 45 further numbers of its local planes."""
    matched = matched or MatchedPair.of(pair)
    observed, model = matched.observed, matched.model
    widths = [np.median(getattr(planes, name)) for name in ("spacing", "extent") for planes in (observed, model)]
    counts = [np.log(len(cloud)) for cloud in (pair.observed, pair.model)]
    distances = [matched.to_model_N, matched.to_observed_M, matched.plane_N, observed.thickness]
    shapes = [matched.plane_M, matched.cosine_N, model.thickness]
    return (
        np.concatenate([np.quantile(values, LEVELS) for values in distances]),
        np.concatenate([*(np.quantile(values, LEVELS) for values in shapes), widths, counts]),
    )


def describe_points(pair: ObservedPair, matched: MatchedPair, points: int) -> np.ndarray:
    """Return (2, points, `CHANNELS`) float32, of the observed cloud and of the model; small clouds repeat points."""
    observed, model = matched.observed, matched.model
    spacing, usual_thickness = float(np.median(model.spacing)), float(np.median(model.thickness))
    log_ratio = partial(log_of_ratio, spacing=spacing)
    sides = []
    for cloud, own, other, partner, distance, from_plane in (
        (pair.observed, observed, model, matched.partner_N, matched.to_model_N, matched.plane_N),
        (pair.model, model, observed, matched.partner_M, matched.to_observed_M, matched.plane_M),
    ):
        logs = log_ratio(distance, spacing), log_ratio(from_plane, usual_thickness)
        relative = log_ratio(own.thickness, other.thickness[partner])
        # Coordinates, logarithms of ratios, and |cosine| between the normals.
        side = np.column_stack([cloud, *logs, relative, np.abs(dots(own.normals, other.normals[partner]))])
        sides.append(side[np.arange(points) % len(side)])
    return np.stack(sides).astype(np.float32)


def log_of_ratio(lengths: np.ndarray, to: np.ndarray | float, spacing: float) -> np.ndarray:
    """Return the logarithm of a ratio of lengths, none of which counts as less than `LEAST` of the model's spacing."""
    return np.log(np.maximum(lengths, LEAST * spacing)) - np.log(np.maximum(to, LEAST * spacing))


def describe_entropy(pair: ObservedPair) -> np.ndarray:
    """Return `ENTROPY` by radius: mean nats joint, apart, their difference; the share with enough neighbors."""
    joint = np.concatenate([pair.observed, pair.model])
    described = np.zeros((len(RADII), 4))
    for row, radius in enumerate(RADII):
        own_N = np.concatenate([_entropies(cloud, radius) for cloud in (pair.observed, pair.model)])
        if (measured_N := np.isfinite(own_N)).any():
            means = _entropies(joint, radius)[measured_N].mean(), own_N[measured_N].mean()
            described[row] = *means, means[0] - means[1], measured_N.mean()
    return described.ravel()


def _entropies(points: np.ndarray, radius: float) -> np.ndarray:
    """Return ½ ln |2πe (Σ + εI)| (N,) of the points within a radius of each; NaN where there are too few."""
    pairs, itself = cKDTree(points).query_pairs(radius, output_type="ndarray"), np.arange(len(points))
    rows, columns = (np.concatenate([pairs[:, i], pairs[:, 1 - i], itself]) for i in (0, 1))
    count_N = np.bincount(rows, minlength=len(points)).astype(float)
    sums_N_3 = [np.bincount(rows, points[columns, i], len(points)) for i in range(3)]
    offset_P_3 = points[columns] - (np.column_stack(sums_N_3) / count_N[:, None])[rows]
    moments_N_3_3 = np.empty((len(points), 3, 3))
    for i, j in np.ndindex(3, 3):
        moments_N_3_3[:, i, j] = np.bincount(rows, offset_P_3[:, i] * offset_P_3[:, j], len(points)) / count_N
    log_determinant_N = np.linalg.slogdet(2 * np.pi * np.e * (moments_N_3_3 + ENTROPY_FLOOR * np.eye(3)))[1]
    return np.where(count_N >= FEWEST_NEIGHBORS, 0.5 * log_determinant_N, np.nan)


QUANTILES = len(LEVELS)
SMALLEST = 1e-5  # diameters; smaller distances are rounding
COARSE = slice(0, QUANTILES, 3)  # five of the thirteen quantiles say as much of a relation
WIDTHS = {"distances": 4 * QUANTILES, "relations": 35, "densities": 2}
POINTS = "points"
MOTION = 5  # of the relations, the last: how far ICP moved the cloud, and how well it then fits
FIT = 2  # of these, the last: the clouds as ICP left them tell as much
MOVED = slice(-MOTION, -FIT)


def describe_registrations(registrations: Registrations, *axes: object, points: int) -> dict[str, np.ndarray]:
    """Return the groups of `WIDTHS`, each (N, F), of N registrations, and the features of so many of their points."""
    rows = []
    for row in progress(range(len(registrations)), "descriptions of pairs"):
        random = generator(*axes, "pair", registrations.split[row], registrations.sample[row])
        pair = observed_once(registrations, row, points, random)
        matched = MatchedPair.of(pair)
        distances, planes = describe_distances(pair, matched)
        spacing, model_spacing, extent, model_extent = np.log(np.maximum(planes[3 * QUANTILES :][:4], SMALLEST))
        densities = [spacing - model_spacing, extent - model_extent]
        features = describe_points(pair, matched, points)
        rows.append((distances, relations(pair, distances, planes), densities, features))
    columns = [[row[column] for row in rows] for column in range(len(WIDTHS) + 1)]
    groups = {name: np.array(columns[n]).reshape(-1, width) for n, (name, width) in enumerate(WIDTHS.items())}
    return groups | {POINTS: np.array(columns[-1], np.float32).reshape(-1, 2, points, CHANNELS)}


def relations(pair: ObservedPair, distances: np.ndarray, planes: np.ndarray) -> np.ndarray:
    """Return 35 numbers that compare the clouds with the model's own spacing and thickness, alike for all objects."""
    to_model, to_observed, from_plane, thickness = distances.reshape(4, QUANTILES)[:, COARSE]
    from_observed_plane, cosine, model_thickness = planes[: 3 * QUANTILES].reshape(3, QUANTILES)[:, COARSE]
    spacing, usual_thickness = planes[3 * QUANTILES + 1], np.median(model_thickness)
    log_ratio = partial(log_of_ratio, spacing=spacing)
    planar = [log_ratio(from_plane, usual_thickness), log_ratio(thickness, model_thickness)]
    planar += [log_ratio(from_observed_plane, usual_thickness), cosine]
    moved_2 = np.sqrt(np.square(log(inverse(pair.T_init)[None])[0]).reshape(2, 3).sum(axis=1))
    motion = [moved_2, displacements(pair.T_init[None], pair.observed)]
    motion += [pair.fitness_n, log_ratio(pair.inlier_rmse_n, spacing)]
    return np.concatenate([log_ratio(to_model, spacing), log_ratio(to_observed, spacing), *planar, *motion])
