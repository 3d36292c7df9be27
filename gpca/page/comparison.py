"""The comparison with the paper for the page: numbers with the digits that the paper prints, verdicts with a tone."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from gpca.comparison.published import table_in_words
from gpca.comparison.verdicts import CLOSE, COMPARISON_COLUMNS, NOT_REPRODUCED, REPRODUCED
from gpca.errors import refusing
from gpca.io.csv_file import read_csv

TONES = {REPRODUCED: "good", CLOSE: "near", NOT_REPRODUCED: "bad"}  # other verdicts judge nothing
REPEAT, DEVIATION = "repeat", "standard deviation"  # rows that are counted apart from the verdicts
_NUMBERS = ("published", "upper", "deviation", "reproduced", "ci_low", "ci_high", "difference")


def page_comparison(path: str | Path) -> dict | None:
    """Return the rows of ``comparison.csv`` in words by table, and verdicts with tone and number; None without it.

    Repeats of a value and standard deviations are counted apart. A table's title names its only objects; otherwise each
    row does, unless its name says so.
    """
    if not Path(path).is_file():
        return None
    rows = []
    for number, row in enumerate(read_csv(path, COMPARISON_COLUMNS).to_dict("records"), 2):
        with refusing(f"{path}, line {number}", "holds no numbers of a comparison ({})", "regenerate it"):
            rows.append(_printed(row))
    tables = []
    for name in dict.fromkeys(row["table"] for row in rows):
        table_rows = [row for row in rows if row["table"] == name]
        objects = list(dict.fromkeys(row["objects"] for row in table_rows if row["objects"]))
        for row in table_rows:
            if len(objects) == 1 or any(row["objects"].startswith(row[key]) for key in ("row", "column")):
                row["objects"] = ""
        tables.append({"name": name, "title": table_in_words(name), "objects": "; ".join(objects), "rows": table_rows})
    counts = Counter(row["group"] for row in rows)
    order = [*TONES, *sorted(set(counts) - {*TONES, DEVIATION, REPEAT}), DEVIATION, REPEAT]
    return {
        "tables": tables,
        "verdicts": [(verdict, TONES.get(verdict, ""), counts[verdict]) for verdict in order if counts[verdict]],
    }


def _printed(row: Mapping[str, str]) -> dict[str, str]:
    """Return the entries of a row as printed; texts stay as they are."""
    printed = {}
    for name in _NUMBERS:  # numbers in round tens have -1 decimals
        text, decimals = row[name], max(0, int(row["decimals"]))
        value = float(text) if text not in ("", "nan") else None
        short = value is not None and value and not round(value, decimals)  # would be printed as 0
        printed[name] = "" if value is None else f"{value:.1g}" if short else f"{value:.{decimals}f}"
    upper, deviation = printed["upper"], printed["deviation"]
    apart = REPEAT if row["repeat_of"] else DEVIATION if row["statistic"] == "deviation" else ""
    repeat = f"repeat of {row['repeat_of']}" if row["repeat_of"] else ""
    needed = f"n = {float(row['n_needed']):.0f} would decide" if row["n_needed"] else ""
    low, high = printed["ci_low"], printed["ci_high"]
    published = printed["published"] + (f" to {upper}" if upper else "") + (f" ± {deviation}" if deviation else "")
    return {
        **{name: row[name] for name in ("table", "row", "column", "unit", "n", "verdict")},
        "group": apart or row["verdict"],
        "reason": "; ".join(filter(None, (repeat, row["reason"], needed))),
        "tone": TONES.get(row["verdict"], ""),
        "objects": ", ".join(filter(None, (row["objects"], row["hardware"]))),
        "published": published,
        "reproduced": ("> " if row["at_least"] == "True" else "") + printed["reproduced"],
        "interval": f"[{low}, {high}]" if low and high else "",
        "difference": printed["difference"],
        "factor": f"× {float(row['factor']):.2g}" if row["factor"] else "",
    }
