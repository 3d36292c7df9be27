"""The files of active learning: a row per round of labels or per so many arrivals of a stream."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.io.csv_file import numbers, read_csv, write_csv

if TYPE_CHECKING:
    import pandas as pd

POOL_COLUMNS = ("setting", "held_out", "labels", "new_labels", "accuracy", "accuracy_new", "epochs")
STREAM_COLUMNS = (
    "setting",
    "held_out",
    "arrived",
    "present",
    "labels",
    "new_labels",
    "running",
    "accuracy",
    "accuracy_new",
)
_SHARED = ("setting", "held_out", "labels", "accuracy", "accuracy_new")


def write_curves(
    path: str | Path, curves: dict[tuple[str, str], list[dict[str, float]]], columns: Iterable[str]
) -> None:
    """Write the curves of one source, strategy and seed, keyed by setting and concept held out."""
    import pandas as pd

    rows = [
        {"setting": setting, "held_out": held_out, **step}
        for (setting, held_out), steps in curves.items()
        for step in steps
    ]
    write_csv(path, pd.DataFrame(rows)[list(columns)])


def read_curves(path: str | Path) -> dict[tuple[str, str], pd.DataFrame]:
    """Read what :func:`write_curves` wrote; all columns but the first two are numbers.

    Raises:
        InputError: missing, empty or unreadable file, missing column, something that is not a finite number.
    """
    rows = read_csv(path, _SHARED, others=(*POOL_COLUMNS, *STREAM_COLUMNS))
    for column in rows.columns[2:]:
        # Before the first arrival there is no running accuracy; without test samples of a concept, none of it.
        rows[column] = numbers(path, rows, column, rows[column] != "")
    return {key: part.reset_index(drop=True) for key, part in rows.groupby(["setting", "held_out"], sort=False)}
