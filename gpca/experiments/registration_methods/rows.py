"""The file of what one method made of the test pairs of a source and seed: a row per pair and start."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gpca.io.csv_file import numbers, read_csv
from gpca.pairs.perturbation import SEVERITIES

if TYPE_CHECKING:
    import pandas as pd

INITIAL, NO_START = "initial", "none"  # where a registration starts, or the name of a global method
SEVERITY_COLUMNS = tuple(f"severity_{name}" for name in SEVERITIES)
MEASURED = ("add_relative", "rotation_error_rad", "translation_error")
COLUMNS = ("sample", "concept", "start", "success", "failure", *SEVERITY_COLUMNS, *MEASURED)


def row_name(method: str, start: str) -> str:
    """Return e.g. ``gicp``, from its own initial pose, or ``fgr+gicp``, from that of another method."""
    return method if start in (INITIAL, NO_START) else f"{start}+{method}"


def read_trials(path: str | Path) -> pd.DataFrame:
    """Read a file of the step ``register_methods``: `success` as booleans, numbers as numbers, the rest as text."""
    rows = read_csv(path, COLUMNS, others=("object", "symmetric", "fitness", "inlier_rmse"))
    for name in (*SEVERITY_COLUMNS, *MEASURED):
        rows[name] = numbers(path, rows, name)
    return rows.assign(success=rows["success"] == "True")
