"""Measurements of registrations as the paper's protocol makes them: two clouds and a single run of ICP."""

from __future__ import annotations

from functools import partial

import numpy as np

from gpca.alignment.pose_error import displacements
from gpca.pairs import distances as measured
from gpca.pairs.dataset import Registrations
from gpca.pairs.distances import LEVELS, MatchedPair, ObservedPair
from gpca.process.progress import progress
from gpca.rigid import inverse, log
from gpca.seeds import generator

QUANTILES = len(LEVELS)
SMALLEST = 1e-5  # diameters; smaller distances are rounding
COARSE = slice(0, QUANTILES, 3)  # five of the thirteen quantiles say as much of a relation
WIDTHS = {"distances": 4 * QUANTILES, "relations": 35, "densities": 2}
POINTS = "points"
MOTION = 5  # of the relations, the last: how far ICP moved the cloud, and how well it then fits
FIT = 2  # of these, the last: the clouds as ICP left them tell as much
MOVED = slice(-MOTION, -FIT)


def describe_registrations(registrations: Registrations, *axes: object, points: int) -> dict[str, np.ndarray]:
    """Return the groups of `WIDTHS`, each (N, F), of N registrations, and the features of their points.

    Distances and points are as :mod:`gpca.pairs.distances` describes them; relations (:func:`relations`) do not depend
    on which object it is; densities are logarithms of spacing and extent of the observed cloud relative to the model's.
    The axes name the draws, with split and number of a sample, of so many points of each cloud; all where there are
    fewer.
    """
    rows = []
    for row in progress(range(len(registrations)), "descriptions of pairs"):
        random = generator(*axes, "pair", registrations.split[row], registrations.sample[row])
        pair = measured.observed_once(registrations, row, points, random)
        matched = MatchedPair.of(pair)
        distances, planes = measured.describe_distances(pair, matched)
        spacing, model_spacing, extent, model_extent = np.log(np.maximum(planes[3 * QUANTILES :][:4], SMALLEST))
        densities = [spacing - model_spacing, extent - model_extent]
        features = measured.describe_points(pair, matched, points)
        rows.append((distances, relations(pair, distances, planes), densities, features))
    columns = [[row[column] for row in rows] for column in range(len(WIDTHS) + 1)]
    groups = {name: np.array(columns[n]).reshape(-1, width) for n, (name, width) in enumerate(WIDTHS.items())}
    return groups | {POINTS: np.array(columns[-1], np.float32).reshape(-1, 2, points, measured.CHANNELS)}


def relations(pair: ObservedPair, distances: np.ndarray, planes: np.ndarray) -> np.ndarray:
    """Return 35 numbers that compare the clouds with what the model alone would give.

    An object's own shape sets how far its points lie apart and how thick its local planes are. Logarithms of quantiles,
    relative to these, are alike for all objects: of the distances both ways to the model's spacing, of the distances
    from the planes both ways to the model's median thickness, of the observed thickness to the model's; then the
    quantiles of |cosine| between normals, and the motion: angle (radians), length and displacement (diameters),
    fitness, and the inlier RMSE relative to the spacing. The distances and planes are those of
    :func:`gpca.pairs.distances.describe_distances`.
    """
    to_model, to_observed, from_plane, thickness = distances.reshape(4, QUANTILES)[:, COARSE]
    from_observed_plane, cosine, model_thickness = planes[: 3 * QUANTILES].reshape(3, QUANTILES)[:, COARSE]
    spacing, usual_thickness = planes[3 * QUANTILES + 1], np.median(model_thickness)

    log_ratio = partial(measured.log_of_ratio, spacing=spacing)
    moved = log(inverse(pair.T_init)[None])[0]
    return np.concatenate(
        [
            log_ratio(to_model, spacing),
            log_ratio(to_observed, spacing),
            log_ratio(from_plane, usual_thickness),
            log_ratio(thickness, model_thickness),
            log_ratio(from_observed_plane, usual_thickness),
            cosine,
            [np.sqrt(np.square(moved[:3]).sum()), np.sqrt(np.square(moved[3:]).sum())],
            displacements(pair.T_init[None], pair.observed),
            pair.fitness_n,
            log_ratio(pair.inlier_rmse_n, spacing),
        ]
    )
