"""Words the comparison for the page: numbers with the digits that the paper prints, verdicts with a tone."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from gpca.comparison.verdicts import CLOSE, COMPARISON_COLUMNS, NOT_REPRODUCED, REPRODUCED
from gpca.errors import InputError
from gpca.io.csv_file import read_csv

TONES = {REPRODUCED: "good", CLOSE: "near", NOT_REPRODUCED: "bad"}  # Other verdicts judge nothing.
_COLUMNS = (
    "table",
    "row",
    "column",
    "unit",
    "published",
    "decimals",
    "reproduced",
    "ci_low",
    "ci_high",
    "n",
    "difference",
    "verdict",
    "reason",
)
REPEAT, DEVIATION = "repeat", "standard deviation"  # Rows that are counted apart, whatever their verdict.
_NUMBERS = ("published", "upper", "deviation", "reproduced", "ci_low", "ci_high", "difference")


def page_comparison(path: str | Path, reference: str | Path | None = None) -> dict | None:
    """Return the rows of ``comparison.csv`` in words, its tables, and verdicts with tone and number; None without it.

    Where no number of the run is judged, as on stand-ins, the rows are those of the reference, and each has what the
    run gives as ``this_run``. Repeats of a value and standard deviations are counted apart.

    Args:
        path: The file of the run.
        reference: That of a run on real objects.

    Raises:
        InputError: an unreadable file, a missing column, no rows, a number that is none.
    """
    if not Path(path).is_file():
        return None
    rows = read_csv(path, _COLUMNS, others=COMPARISON_COLUMNS)
    words = [_words(path, row) for row in rows.to_dict("records")]
    of_reference = False
    if reference is not None and not set(TONES) & set(rows["verdict"]):
        of_reference = True
        here = {_key(row): row["reproduced"] for row in words}
        rows = read_csv(reference, _COLUMNS, others=COMPARISON_COLUMNS)
        words = [_words(reference, row) for row in rows.to_dict("records")]
        words = [row | {"this_run": here.get(_key(row), "")} for row in words]
    counts = Counter(row["group"] for row in words)
    order = [*TONES, *sorted(set(counts) - {*TONES, DEVIATION, REPEAT}), DEVIATION, REPEAT]
    return {
        "of_reference": of_reference,
        "rows": words,
        "tables": list(dict.fromkeys(rows["table"])),
        "verdicts": [(verdict, TONES.get(verdict, ""), counts[verdict]) for verdict in order if counts[verdict]],
    }


def _key(row: Mapping[str, str]) -> tuple[str, ...]:
    return row["table"], row["row"], row["column"]


def _words(path: str | Path, row: Mapping[str, str]) -> dict[str, str]:
    """Return the entries of a row as they are printed; the texts stay as they are."""
    printed = {name: _rounded(path, row, name) for name in _NUMBERS}
    published = printed["published"]
    if printed["upper"]:
        published += f" to {printed['upper']}"
    if printed["deviation"]:
        published += f" ± {printed['deviation']}"
    repeat_of = row.get("repeat_of", "")
    apart = REPEAT if repeat_of else DEVIATION if row.get("statistic") == "deviation" else ""
    bound = "> " if row.get("at_least", "").lower() == "true" else ""
    return {name: row[name] for name in ("table", "row", "column", "unit", "n", "verdict")} | {
        "group": apart or row["verdict"],
        "reason": "; ".join(filter(None, (f"repeat of {repeat_of}" if repeat_of else "", row["reason"]))),
        "tone": TONES.get(row["verdict"], ""),
        "objects": ", ".join(filter(None, (row.get("objects", ""), row.get("hardware", "")))),
        "published": published,
        "reproduced": bound + printed["reproduced"],
        "interval": f"[{printed['ci_low']}, {printed['ci_high']}]" if printed["ci_low"] and printed["ci_high"] else "",
        "difference": printed["difference"],
        "factor": f"× {_number(path, row, 'factor'):.2g}" if row.get("factor") else "",
    }


def _rounded(path: str | Path, row: Mapping[str, str], name: str) -> str:
    """Return a number with as many digits as the printed one, or one of its own where that would be 0; or nothing."""
    if row.get(name, "") in ("", "nan"):
        return ""
    value = _number(path, row, name)
    decimals = max(0, _number(path, row, "decimals", int))  # Numbers printed in round tens have fewer than 0.
    return f"{value:.{decimals}f}" if round(value, decimals) or not value else f"{value:.1g}"


def _number(path: str | Path, row: Mapping[str, str], name: str, kind: type = float):
    try:
        value = kind(row[name])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(path, f"'{name}' contains a value that is not a number: '{row[name]}'", "regenerate it")
    return value
