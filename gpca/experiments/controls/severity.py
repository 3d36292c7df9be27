"""Accuracy of the explainers and success of the registrations, in bins of the perturbations' severity."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError
from gpca.evaluation.measures import source_method_seed
from gpca.experiments.controls.metrics import read_controls
from gpca.experiments.controls.samples import OF_CONCEPT, SEVERITIES, read_samples
from gpca.experiments.controls.settings import PAPER
from gpca.io.csv_file import read_numbers
from gpca.pairs.perturbation import Severities
from gpca.pairs.synthesis import RegistrationSettings

if TYPE_CHECKING:
    import pandas as pd

REGISTRATION = "registration"  # in the place of an explainer: the share of registrations that succeed
COLUMNS = ("concept", "method", "low", "high", "other_low", "other_high", "samples", "value")


def collect(
    prediction_files: Iterable[str | Path],
    sample_files: Iterable[str | Path],
    severities: dict[str, list[float]],
    bins: int,
    success: float,
) -> pd.DataFrame:
    """Return accuracy of every explainer and the share of registrations that succeed, by severity, over all sources.

    Args:
        prediction_files, sample_files: named ``…/{source}/seed{seed}.csv``.
        severities: range of each, as the config has them.
        bins: of each range, equally wide; those of pose have two ranges, rotation and translation.
        success: error below which a registration has succeeded.

    Raises:
        InputError: an unusable file, or a test sample without severities.
    """
    import pandas as pd

    ranges = RegistrationSettings.from_dict({"severities": severities}).severities
    judged = read_controls(prediction_files)
    judged = judged[judged["control"] == PAPER]
    samples = []
    for path in sample_files:
        _, source, seed = source_method_seed(path)
        own = read_samples(path)
        own = own[own["control"] == PAPER].assign(source=source, seed=seed)
        samples.append(_with_bins(own, ranges, bins))
    table = pd.concat(samples, ignore_index=True)
    with_severity = judged.merge(
        table, on=["source", "seed", "sample"], suffixes=("", "_of_sample"), validate="many_to_one"
    )
    if len(with_severity) != len(judged):
        raise InputError("samples of the controls", "lack test samples of the predictions", "regenerate both")
    outcomes = table.assign(explainer=REGISTRATION, right=table["error"] < success)
    everything = pd.concat([outcomes, with_severity[outcomes.columns]])
    records = []
    for concept, names in OF_CONCEPT.items():
        of_concept = everything[everything["concept"] == concept]
        for (method, *places), rows in of_concept.groupby(["explainer", *map(_bin, names)], sort=False):
            edges = [_edges(ranges, name, bins)[i : i + 2] for name, i in zip(names, places, strict=True)]
            bounds = np.concatenate([*edges, [np.nan] * 2])[:4]
            records.append((concept, method, *bounds, len(rows), float(rows["right"].mean())))
    with_severity = pd.DataFrame(records, columns=list(COLUMNS))
    return with_severity.sort_values(list(COLUMNS[:6]), kind="stable", ignore_index=True)


def read_severities(path: str | Path) -> pd.DataFrame:
    """Read what :func:`collect` returned; only pose has bounds of a second severity, its translation.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a value that is no finite number.
    """
    return read_numbers(path, COLUMNS, COLUMNS[2:], optional=("other_low", "other_high"))


def _edges(ranges: Severities, name: str, bins: int) -> np.ndarray:
    low, high = getattr(ranges, name)
    return np.linspace(low, high, bins + 1)


def _bin(severity: str) -> str:
    return f"bin_{severity}"


def _with_bins(samples: pd.DataFrame, ranges: Severities, bins: int) -> pd.DataFrame:
    """Return the samples with the number of the bin of each severity; 0 where it was not applied."""
    for name in SEVERITIES:
        edges = _edges(ranges, name, bins)
        samples[_bin(name)] = np.clip(np.searchsorted(edges, samples[name], side="right") - 1, 0, bins - 1)
    return samples
