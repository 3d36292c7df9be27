"""The files that hold one row per sample: what an explainer said of it, and the seconds that it took.

Written with six decimals, read as text first, so that nothing which is not a number passes for one.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError
from gpca.io.csv_file import numbers, read_csv, write_csv

if TYPE_CHECKING:
    import pandas as pd

    from gpca.attribution.scores import Attribution
    from gpca.pairs.dataset import Registrations

PREDICTION_COLUMNS = ("sample", "split", "object", "concept_true", "concept_predicted", "abstained", "icp_calls")
TIMING_COLUMNS = ("sample", "split", "seconds", "icp_seconds")
_OF_CONCEPTS = ("score_?*", "variance_?*", "bald", "entropy")  # further columns; an explainer may lack some
_TRUTH = {"true": True, "1": True, "false": False, "0": False}


def write_predictions(path: str | Path, registrations: Registrations, attribution: Attribution) -> None:
    """Write the prediction file that every table is made from (results/README.md)."""
    write_csv(path, prediction_frame(registrations, attribution))


def prediction_frame(registrations: Registrations, attribution: Attribution) -> pd.DataFrame:
    """Return the columns of a prediction file."""
    import pandas as pd

    return pd.DataFrame(
        {
            "sample": registrations.sample,
            "split": registrations.split,
            "object": registrations.object_name,
            "concept_true": registrations.concept,
            "concept_predicted": attribution.predicted_N,
            **{f"score_{c}": attribution.scores_N_C[:, i] for i, c in enumerate(attribution.concepts)},
            **{f"variance_{c}": attribution.variances_N_C[:, i] for i, c in enumerate(attribution.concepts)},
            "bald": attribution.bald_N,
            "entropy": attribution.entropy_N,
            "abstained": attribution.abstained_N,
            "icp_calls": attribution.icp_calls_N,
        }
    )


def read_predictions(path: str | Path, labels: Sequence[str] = ()) -> pd.DataFrame:
    """Read a prediction file as text, but for `score_…`, `variance_…` and `icp_calls` (numbers) and `abstained` (bool).

    Args:
        path: the file.
        labels: columns before those of the samples; a number may occur once for each combination of theirs.

    Raises:
        InputError: missing, empty or unreadable file; missing column; a concept without a score column; a sample
            twice in one split (and under the same labels); a split other than train and test; a score or a number of
            ICP calls that is not a finite number; a variance that is neither that nor empty; negative variances or
            numbers of calls.
    """
    rows = read_csv(path, (*labels, *PREDICTION_COLUMNS), _OF_CONCEPTS)
    concepts = concepts_of(rows)
    if not concepts:
        raise InputError(path, "has no column score_<concept>", "regenerate it")
    rows["abstained"] = rows["abstained"].str.lower().map(_TRUTH)
    if rows["abstained"].isna().any():
        raise InputError(path, "column 'abstained' contains values other than True and False", "regenerate it")
    rows["abstained"] = rows["abstained"].astype(bool)
    for column in ("concept_true", "concept_predicted"):
        known = rows[column].isin(concepts)
        if column == "concept_predicted":
            known |= rows["abstained"] & (rows[column] == "")
        if not known.all():
            unknown = rows.loc[~known, column].iloc[0]
            raise InputError(
                path, f"unknown concept '{unknown}' in '{column}'", f"its concepts are {', '.join(concepts)}"
            )
    require_samples(path, rows, (*labels, "split", "sample"))
    rows["icp_calls"] = numbers(path, rows, "icp_calls", least=0)
    for column in (name for name in rows.columns if name.startswith(("score_", "variance_"))):
        # Every explainer that does not abstain has scores; one without variances leaves them empty.
        needed = ~rows["abstained"] if column.startswith("score_") else rows[column] != ""
        least = -np.inf if column.startswith("score_") else 0
        rows[column] = numbers(path, rows, column, needed, least)
    return rows


def concepts_of(predictions: pd.DataFrame) -> list[str]:
    """Return the concepts that predictions score, in the order of their columns."""
    return [name.removeprefix("score_") for name in predictions.columns if name.startswith("score_")]


def write_timings(
    path: str | Path, registrations: Registrations, seconds_S: np.ndarray, icp_seconds_S: np.ndarray
) -> None:
    """Write seconds per sample; apart from the predictions, because they differ from run to run."""
    import pandas as pd

    columns = {"sample": registrations.sample, "split": registrations.split}
    write_csv(path, pd.DataFrame(columns | {"seconds": seconds_S, "icp_seconds": icp_seconds_S}))


def read_timings(path: str | Path, registrations: Registrations) -> tuple[np.ndarray, np.ndarray]:
    """Return seconds (S,) and icp_seconds (S,) of the registrations.

    Raises:
        InputError: missing, empty or unreadable file; missing column; other samples; seconds that are not numbers, or
            negative.
    """
    rows = read_csv(path, TIMING_COLUMNS)
    for name in ("sample", "split"):
        if rows[name].tolist() != getattr(registrations, name).astype(str).tolist():
            raise InputError(path, "does not contain the times of these samples", "regenerate it")
    seconds, icp_seconds = (numbers(path, rows, name, least=0).to_numpy() for name in ("seconds", "icp_seconds"))
    return seconds, icp_seconds


def require_samples(path: str | Path, rows: pd.DataFrame, keys: Iterable[str] = ("split", "sample")) -> None:
    """Raise an InputError unless each sample of a split stands once."""
    if rows.duplicated(list(keys)).any():
        raise InputError(path, "contains a sample twice", "regenerate it")
