"""The files with one row per sample: an explainer's prediction, and the seconds that it took."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.errors import InputError
from gpca.io.container import require_same_samples
from gpca.io.csv_file import numbers, read_columns, read_csv, write_columns
from gpca.io.frame import Frame

if TYPE_CHECKING:
    from gpca.classifier.scores import Attribution
    from gpca.pairs.dataset import Registrations

PREDICTION_COLUMNS = (
    *("sample", "split", "object", "cluster", "concept_true", "concept_predicted", "abstained", "icp_calls"),
)
TIMING_COLUMNS = ("sample", "split", "seconds", "icp_seconds")
_OF_CONCEPTS = ("score_?*", "variance_?*", "bald", "entropy")  # further columns; an explainer may lack some


def write_predictions(path: str | Path, registrations: Registrations, attribution: Attribution) -> None:
    write_columns(path, _columns(registrations, attribution))


def prediction_frame(registrations: Registrations, attribution: Attribution, **labels: Any) -> Frame:
    """Return the columns of a prediction file after those of labels, which tell its rows from those of others."""
    import pandas as pd

    return pd.DataFrame({**labels, **_columns(registrations, attribution)})


def _columns(registrations: Registrations, attribution: Attribution) -> dict[str, np.ndarray]:
    return {
        "sample": registrations.sample,
        "split": registrations.split,
        "object": registrations.object_name,
        "cluster": registrations.cluster,
        "concept_true": registrations.concept,
        "concept_predicted": attribution.predicted_N,
        **{f"score_{c}": attribution.scores_N_C[:, i] for i, c in enumerate(attribution.concepts)},
        **{f"variance_{c}": attribution.variances_N_C[:, i] for i, c in enumerate(attribution.concepts)},
        "bald": attribution.bald_N,
        "entropy": attribution.entropy_N,
        "abstained": attribution.abstained_N,
        "icp_calls": attribution.icp_calls_N,
    }


def read_predictions(path: str | Path, labels: Sequence[str] = ()) -> Frame:
    """Read a prediction file, numbers and flags as such; a sample stands once for each combination of `labels`."""
    rows = read_csv(path, (*labels, *PREDICTION_COLUMNS), _OF_CONCEPTS)
    rows["abstained"] = rows["abstained"] == "True"
    if unknown := set(rows["concept_true"]) - set(concepts := concepts_of(rows)):
        raise InputError(path, f"unknown concept '{min(unknown)}'", f"its concepts are {', '.join(concepts)}")
    require_samples(path, rows, (*labels, "split", "sample"))
    rows["icp_calls"] = numbers(path, rows, "icp_calls")
    for column in (name for name in rows.columns if name.startswith(("score_", "variance_"))):
        # Every explainer that does not abstain has scores; one without variances leaves them empty.
        needed = ~rows["abstained"] if column.startswith("score_") else rows[column] != ""
        rows[column] = numbers(path, rows, column, needed)
    return rows


def concepts_of(predictions: Frame) -> list[str]:
    return [name.removeprefix("score_") for name in predictions.columns if name.startswith("score_")]


def write_timings(
    path: str | Path, registrations: Registrations, seconds_S: np.ndarray, icp_seconds_S: np.ndarray
) -> None:
    columns = {"sample": registrations.sample, "split": registrations.split}
    write_columns(path, columns | {"seconds": seconds_S, "icp_seconds": icp_seconds_S})


def read_timings(path: str | Path, registrations: Registrations) -> tuple[np.ndarray, np.ndarray]:
    rows = read_columns(path, TIMING_COLUMNS, ("seconds", "icp_seconds"))
    require_same_samples(path, rows, registrations.arrays)
    return np.asarray(rows["seconds"]), np.asarray(rows["icp_seconds"])


def require_samples(path: str | Path, rows: Frame, keys: Iterable[str] = ("split", "sample")) -> None:
    if rows.duplicated(list(keys)).any():
        raise InputError(path, "contains a sample twice", "regenerate it")
