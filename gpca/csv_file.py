"""CSV files, every fault said in one line."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError
from gpca.files import whole_file
from gpca.limits import require_file
from gpca.numerals import decimal

if TYPE_CHECKING:
    import pandas as pd


def read_csv(path: str | Path, columns: Iterable[str]) -> pd.DataFrame:
    """Read a CSV file with at least these columns and one row, every entry as the text that stands there.

    Raises:
        InputError: missing, empty or unreadable file, column that is missing or there twice, no rows, rows longer than
            the head.
    """
    require_file(path, "no such file", "make it with snakemake")
    import pandas as pd

    try:
        rows = pd.read_csv(path, dtype=str, keep_default_na=False)
    except pd.errors.EmptyDataError as fault:
        raise InputError(path, "is empty", "regenerate it") from fault
    except (pd.errors.ParserError, UnicodeDecodeError, OSError) as fault:
        raise InputError(path, f"is not a readable CSV file ({fault})", "regenerate it") from fault
    missing = [column for column in columns if column not in rows.columns]
    if missing:
        raise InputError(path, f"column '{missing[0]}' is missing", "regenerate it")
    if not isinstance(rows.index, pd.RangeIndex):  # pandas takes what is too much for an index, and shifts the rest
        raise InputError(path, "has rows with more entries than columns", "regenerate it")
    # pandas gives the second of two columns another name, so the head is read once more as it stands.
    head = pd.read_csv(path, dtype=str, keep_default_na=False, header=None, nrows=1).iloc[0]
    if (twice := head[head.duplicated()]).size:
        raise InputError(path, f"column '{twice.iloc[0]}' appears twice", "regenerate it")
    if rows.empty:
        raise InputError(path, "has no rows", "regenerate it")
    return rows


def numbers(path: str | Path, rows: pd.DataFrame, column: str, needed=True, least: float = -np.inf) -> pd.Series:
    """Return a column as float64; NaN where it is not `needed` and no number.

    Raises:
        InputError: no number where one is needed; a number below `least`.
    """
    import pandas as pd

    values = pd.to_numeric(rows[column], errors="coerce").astype(float)
    if (~np.isfinite(values) & needed).any():
        raise InputError(path, f"column '{column}' contains values that are not finite numbers", "regenerate it")
    if (values < least).any():
        raise InputError(path, f"column '{column}' contains numbers below {least:g}", "regenerate it")
    return values


def finite_number(subject: object, name: str, text: str, remedy: str = "regenerate it") -> float:
    """Return the number that one field holds; `subject` and `name` say where it stands.

    Raises:
        InputError: no number, NaN or infinity.
    """
    try:
        return decimal(text.strip())
    except ValueError as fault:
        raise InputError(subject, f"'{name}' is '{text[:40]}', not a finite number", remedy) from fault


def write_csv(path: str | Path, frame: pd.DataFrame, form: str | None = "%.6f") -> None:
    """Write a CSV file, whole or not at all; `form` is that of numbers with decimals, None for all their digits."""
    with whole_file(path) as partial:
        frame.to_csv(partial, index=False, float_format=form, lineterminator="\n")
