"""CSV files, with a one-line message for every fault."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError
from gpca.io.files import SPLITS, require_file, whole_file
from gpca.numerals import decimal

if TYPE_CHECKING:
    import pandas as pd

    from gpca.io.container import Columns

_CONTROL = r"[\x00-\x08\x0a-\x1f\x7f]"  # all but tabs
NAMES = ("object", "cluster", "method", "explainer", "policy")  # columns of names, which must not be empty
ANY = ("*",)
Texts = Iterable[str]


def read_csv(path: str | Path, columns: Texts, others: Texts = (), remedy: str = "regenerate it") -> pd.DataFrame:
    """Read a CSV file as text, with the required columns and patterns of others; InputError for a damaged one."""
    require_file(path, "no such file", "make it with snakemake")
    import pandas as pd

    try:
        rows = pd.read_csv(path, dtype=str, keep_default_na=False)
    except pd.errors.EmptyDataError as fault:
        raise InputError(path, "is empty", remedy) from fault
    except (pd.errors.ParserError, UnicodeDecodeError, OSError) as fault:
        raise InputError(path, f"is not a readable CSV file ({fault})", remedy) from fault
    needed = tuple(columns)
    if missing := [column for column in needed if column not in rows.columns]:
        raise InputError(path, f"column '{missing[0]}' is missing", remedy)
    if not isinstance(rows.index, pd.RangeIndex):  # pandas takes surplus entries as the index
        raise InputError(path, "has rows with more entries than columns", remedy)
    # pandas renames repeated columns, so the head is read again without names.
    head = pd.read_csv(path, dtype=str, keep_default_na=False, header=None, nrows=1).iloc[0]
    if (twice := head[head.duplicated()]).size:
        raise InputError(path, f"column '{twice.iloc[0]}' appears twice", remedy)
    ours = [name for name in head if any(fnmatchcase(str(name), pattern) for pattern in {*needed, *others} - {*ANY})]
    if not {*ANY} & {*others} and (unknown := [name for name in head if name not in ours]):
        raise InputError(path, f"column '{unknown[0]}' is unknown", remedy)
    if rows.empty:
        raise InputError(path, "has no rows", remedy)
    for name, entries in rows[ours].items():
        faults = [("a line break or another control character", entries.str.contains(_CONTROL))]
        if name in NAMES:
            faults.append(("an empty name", entries.str.strip() == ""))
        if name == "split":
            faults.append(("a split that is neither train nor test", ~entries.isin(SPLITS)))
        for fault_of_entry, at in faults:
            if at.any():
                line = f"{path}, line {at.argmax() + 2}"
                raise InputError(line, f"column '{name}' contains {fault_of_entry}", remedy)
    return rows


def numbers(path: str | Path, rows: pd.DataFrame, column: str, needed=True, least: float = -np.inf) -> pd.Series:
    """Return a column as float64; NaN for other entries if they are not `needed`. InputError for one below `least`."""
    import pandas as pd

    values = pd.to_numeric(rows[column], errors="coerce").astype(float)
    if (~np.isfinite(values) & needed).any():
        raise InputError(path, f"column '{column}' contains values that are not finite numbers", "regenerate it")
    if (values < least).any():
        raise InputError(path, f"column '{column}' contains numbers below {least:g}", "regenerate it")
    return values


def read_numbers(
    path: str | Path, columns: Texts, numeric: Texts, optional: Texts = (), others: Texts = ()
) -> pd.DataFrame:
    """Read a CSV file as :func:`read_csv` does, with numeric columns as numbers; empty optional entries become NaN."""
    rows, may_be_empty = read_csv(path, columns, others), set(optional)
    for column in numeric:
        needed = rows[column] != "" if column in may_be_empty else True
        rows[column] = numbers(path, rows, column, needed)
    return rows


def read_columns(path: str | Path, columns: Sequence[str], numeric: Sequence[str]) -> Columns:
    """Read a CSV file as :func:`read_numbers` does, without pandas if it is plain, as most that a step reads are."""
    require_file(path, "no such file", "make it with snakemake")
    try:
        text = Path(path).read_text(encoding="utf-8")
        head, *lines, end = text.split("\n")
        entries = [line.split(",") for line in lines]
        is_plain = head == ",".join(columns) and not end and '"' not in text and all(map(str.isprintable, lines))
        texts = dict(zip(columns, zip(*entries, strict=True), strict=True))  # none where there are no rows
        if is_plain and {*texts.get("split", ())} <= {*SPLITS}:
            return {name: np.array([*map(decimal, of)] if name in numeric else of) for name, of in texts.items()}
    except ValueError:  # of unpacking, decoding, or a number
        pass
    return read_numbers(path, columns, numeric)


def finite_number(subject: object, name: str, text: str, remedy: str = "regenerate it") -> float:
    try:
        return decimal(text.strip())
    except ValueError as fault:
        raise InputError(subject, f"'{name}' is '{text[:40]}', not a finite number", remedy) from fault


def write_csv(path: str | Path, frame: pd.DataFrame, form: str | None = "%.6f") -> None:
    """Write a CSV file, whole or not at all, with floats in `form`; None keeps all digits."""
    with whole_file(path) as partial:
        frame.to_csv(partial, index=False, float_format=form, lineterminator="\n")


def write_columns(path: str | Path, columns: Mapping[str, np.ndarray]) -> None:
    """Write the bytes that :func:`write_csv` does of columns of one type each, without pandas."""
    arrays = map(np.asarray, columns.values())
    entries = [
        ["" if value != value else f"{value:.6f}" for value in of.tolist()] if of.dtype.kind == "f" else of.tolist()
        for of in arrays
    ]
    with whole_file(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*entries, strict=True))
