"""Words the comparison for the page: numbers with the digits that the paper prints, verdicts with a tone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from gpca.comparison.verdicts import CLOSE, COMPARISON_COLUMNS, NOT_REPRODUCED, REPRODUCED
from gpca.io.csv_file import read_csv

TONES = {REPRODUCED: "good", CLOSE: "near", NOT_REPRODUCED: "bad"}  # Other verdicts judge nothing.
REPEAT, DEVIATION = "repeat", "standard deviation"  # Rows that are counted apart, whatever their verdict.
_NUMBERS = ("published", "upper", "deviation", "reproduced", "ci_low", "ci_high", "difference")


def page_comparison(path: str | Path, reference: str | Path | None = None) -> dict | None:
    """Return the rows of ``comparison.csv`` in words, its tables, and verdicts with tone and number; None without it.

    Where no number of the run is judged, as on stand-ins, the rows are those of the reference, and each has what the
    run gives as ``this_run``. Repeats of a value and standard deviations are counted apart.

    Args:
        path: The file of the run.
        reference: That of a run on real objects.
    """
    if not Path(path).is_file():
        return None
    rows = _rows(path)
    of_reference = reference is not None and not any(row["tone"] for row in rows)
    if reference is not None and of_reference:
        here = {_key(row): row["reproduced"] for row in rows}
        rows = [row | {"this_run": here.get(_key(row), "")} for row in _rows(reference)]
    counts = Counter(row["group"] for row in rows)
    order = [*TONES, *sorted(set(counts) - {*TONES, DEVIATION, REPEAT}), DEVIATION, REPEAT]
    return {
        "of_reference": of_reference,
        "rows": rows,
        "tables": list(dict.fromkeys(row["table"] for row in rows)),
        "verdicts": [(verdict, TONES.get(verdict, ""), counts[verdict]) for verdict in order if counts[verdict]],
    }


def _key(row: Mapping[str, str]) -> tuple[str, ...]:
    return row["table"], row["row"], row["column"]


def _rows(path: str | Path) -> list[dict[str, str]]:
    return [_words(row) for row in read_csv(path, COMPARISON_COLUMNS).to_dict("records")]


def _words(row: Mapping[str, str]) -> dict[str, str]:
    """Return the entries of a row as they are printed; the texts stay as they are."""
    printed = {name: _rounded(row[name], int(row["decimals"])) for name in _NUMBERS}
    published = printed["published"]
    if printed["upper"]:
        published += f" to {printed['upper']}"
    if printed["deviation"]:
        published += f" ± {printed['deviation']}"
    apart = REPEAT if row["repeat_of"] else DEVIATION if row["statistic"] == "deviation" else ""
    repeat = f"repeat of {row['repeat_of']}" if row["repeat_of"] else ""
    return {name: row[name] for name in ("table", "row", "column", "unit", "n", "verdict")} | {
        "group": apart or row["verdict"],
        "reason": "; ".join(filter(None, (repeat, row["reason"]))),
        "tone": TONES.get(row["verdict"], ""),
        "objects": ", ".join(filter(None, (row["objects"], row["hardware"]))),
        "published": published,
        "reproduced": ("> " if row["at_least"] == "True" else "") + printed["reproduced"],
        "interval": f"[{printed['ci_low']}, {printed['ci_high']}]" if printed["ci_low"] and printed["ci_high"] else "",
        "difference": printed["difference"],
        "factor": f"× {float(row['factor']):.2g}" if row["factor"] else "",
    }


def _rounded(text: str, decimals: int) -> str:
    """Return a number with as many digits as the printed one, or one of its own where that would be 0; or nothing."""
    if text in ("", "nan"):
        return ""
    value, decimals = float(text), max(0, decimals)  # Numbers printed in round tens have fewer than 0.
    return f"{value:.{decimals}f}" if round(value, decimals) or not value else f"{value:.1g}"
