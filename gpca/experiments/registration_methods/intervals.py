"""Successes and errors of registration methods over all sources and seeds, with intervals over families of objects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.alignment.pose_error import SuccessSettings, success_within
from gpca.errors import InputError
from gpca.evaluation.intervals import Clustered, Estimate
from gpca.evaluation.measures import ALL, intervals, source_method_seed
from gpca.experiments.diagnosis.judged import POOLED
from gpca.experiments.registration_methods.metrics import BINS, TABLE, bin_name, read_trials, row_name, share_of_milder
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.perturbation import CONCEPTS

if TYPE_CHECKING:
    import pandas as pd

ERRORS = {  # metric -> column of the files, the factor to the metric's unit, and the limits of a mean
    "add": ("add_relative", 1.0, (0.0, np.inf)),
    "rotation_deg": ("rotation_error_rad", 180 / np.pi, (0.0, 180.0)),
    "translation": ("translation_error", 1.0, (0.0, np.inf)),
}


def collect_intervals(
    files: Iterable[str | Path],
    objects: Iterable[str | Path],
    severities: Mapping[str, Iterable[float]],
    success: Mapping[str, Any],
) -> pd.DataFrame:
    """Return the metrics of `registration_methods.csv` over all sources and seeds, with 95 % intervals.

    They are those of :mod:`gpca.evaluation.measures`; a cluster is a family of objects of one source, and its draws
    are the same for all methods.

    Args:
        files: named `…/{source}/{method}/seed{seed}.csv`.
        objects: of the same sources, named `…/{source}.npz`; they say which family an object is of.
        severities: the config's ranges, from which the registrations were drawn.
        success: the config's section.

    Raises:
        InputError: no files, a name of another form, a missing column, no rows, an object of none of the sources.
    """
    import pandas as pd

    families = {Path(path).stem: _families(path) for path in objects}
    frames = [_read(path, families) for path in files]
    if not frames:
        raise InputError("registration methods", "no files were given", "name a method under methods")
    limits, records = SuccessSettings(**success), []
    for name, rows in pd.concat(frames, ignore_index=True).groupby("row", sort=False):
        samples = Clustered.drawn(rows["seed"], rows["cluster"], "registration intervals")
        for concept, chosen_N in _groups(rows, severities).items():
            if not chosen_N.any():
                continue
            own = samples.subset(chosen_N)
            estimates = _estimates(rows[chosen_N], own, limits, concept == ALL)
            records += [
                own.record((TABLE, POOLED, str(name), metric, concept), estimate)
                for metric, estimate in estimates.items()
            ]
    return intervals(records, "registration methods")


def _families(path: str | Path) -> dict[str, str]:
    """Return the family of each object of a source by name."""
    objects = ObjectClouds.load(path)
    return {name: objects.family(i) for i, name in enumerate(objects.names)}


def _read(path: str | Path, families: Mapping[str, Mapping[str, str]]) -> pd.DataFrame:
    """Return the rows of a file with their seed, row of the tables and cluster."""
    source, method, seed = source_method_seed(path)
    rows = read_trials(path)
    if "object" not in rows:
        raise InputError(path, "column 'object' is missing", "regenerate it")
    family_N = rows["object"].map(families.get(source, {}))
    if family_N.isna().any():
        fault = f"object '{rows['object'][family_N.isna()].iloc[0]}' is none of objects/{source}.npz"
        raise InputError(path, fault, "regenerate both from the same config")
    row_N = [row_name(method, start) for start in rows["start"]]
    return rows.assign(seed=seed, row=row_N, cluster=f"{source}/" + family_N)


def _groups(rows: pd.DataFrame, severities: Mapping[str, Iterable[float]]) -> dict[str, np.ndarray]:
    """Return which rows (N,) are of each cause, and of each third of its severities."""
    groups = {ALL: np.ones(len(rows), bool)}
    for concept in CONCEPTS:
        of_concept = (rows["concept"] == concept).to_numpy()
        bin_N = np.minimum(3 * share_of_milder(rows, concept, severities), len(BINS) - 1).astype(int)
        groups[concept] = of_concept
        groups |= {bin_name(concept, name): of_concept & (bin_N == i) for i, name in enumerate(BINS)}
    return groups


def _estimates(rows: pd.DataFrame, samples: Clustered, limits: SuccessSettings, every: bool) -> dict[str, Estimate]:
    """Return the success of some rows; of `every` row, also failures, errors, and successes by other limits."""
    failed_N, error_N = (rows["failure"] != "").to_numpy(), rows["add_relative"].to_numpy()
    estimates = {"success": samples.share(~failed_N & (error_N < limits.error))}
    if not every:
        return estimates
    estimates["failed"] = samples.share(failed_N)
    estimates |= {success_within(limit): samples.share(~failed_N & (error_N < limit)) for limit in limits.curve}
    for metric, (column, factor, of_metric) in ERRORS.items():
        estimates[metric] = samples.mean(factor * rows[column].to_numpy(), of_metric)
    return estimates
