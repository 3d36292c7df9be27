"""Words the comparison for the page: numbers with the digits that the paper prints, verdicts with a tone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from gpca.comparison.published import TABLES, TEXT
from gpca.comparison.verdicts import CLOSE, COMPARISON_COLUMNS, NOT_REPRODUCED, REPRODUCED
from gpca.io.csv_file import read_csv

TONES = {REPRODUCED: "good", CLOSE: "near", NOT_REPRODUCED: "bad"}  # Other verdicts judge nothing.
REPEAT, DEVIATION = "repeat", "standard deviation"  # Rows that are counted apart, whatever their verdict.
_NUMBERS = ("published", "upper", "deviation", "reproduced", "ci_low", "ci_high", "difference")


def page_comparison(path: str | Path, reference: str | Path | None = None) -> dict | None:
    """Return the rows of ``comparison.csv`` in words by table, and verdicts with tone and number; None without it.

    Where no number of the run is judged, as on stand-ins, the rows are those of the reference, and each has what the
    run gives as ``this_run``. Repeats of a value and standard deviations are counted apart. What a table was measured
    on is said once, with its title; a row says it where the table has several and the row's names do not tell which.

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
        "tables": [_of_table(name, of) for name, of in _by_table(rows).items()],
        "verdicts": [(verdict, TONES.get(verdict, ""), counts[verdict]) for verdict in order if counts[verdict]],
    }


def _by_table(rows: Sequence[dict[str, str]]) -> dict[str, list[dict[str, str]]]:
    tables: dict[str, list[dict[str, str]]] = {}
    for row in rows:
        tables.setdefault(row["table"], []).append(row)
    return tables


def _of_table(name: str, rows: Sequence[dict[str, str]]) -> dict:
    objects = list(dict.fromkeys(row["objects"] for row in rows if row["objects"]))
    said = [row | {"objects": "" if len(objects) == 1 or _is_named(row) else row["objects"]} for row in rows]
    title = TABLES[name].title if name in TABLES else ""
    words = title if name == TEXT else f"Table {name}: {title}"
    return {"name": name, "title": words, "objects": "; ".join(objects), "rows": said}


def _is_named(row: Mapping[str, str]) -> bool:
    """Return whether a row's or a column's name tells the objects, as "YCB" does."""
    return any(row["objects"].startswith(row[key]) for key in ("row", "column"))


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
