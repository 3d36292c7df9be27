"""Writes the comparison as Markdown: the counts of each verdict, then a table for each of the paper's with reasons."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from gpca.comparison.published import HARDWARE, TABLES, TEXT
from gpca.comparison.verdicts import VERDICTS, counts
from gpca.objects.title import STAND_IN
from gpca.reporting.tables.table import EMPTY

if TYPE_CHECKING:
    import pandas as pd

_HEADS = ("Row", "Column", "Unit", "Paper", "Here", "n", "Difference", "Verdict")
_BOLD = (VERDICTS[0],)


def comparison_markdown(comparison: pd.DataFrame, tolerances: Mapping[str, Mapping]) -> str:
    """Return the page.

    Args:
        comparison: The frame that :func:`gpca.comparison.verdicts.compare` returns.
        tolerances: The tolerances of each unit, as in the config.
    """
    parts = ["# Published and reproduced", summary(comparison), counts_table(comparison), *_rule(tolerances)]
    for table, rows in comparison.groupby("table", sort=False):
        parts += [f"## {_name(table)}", _table(rows), *_reasons(rows), *_objects(rows)]
    return "\n\n".join(parts) + "\n"


def summary(comparison: pd.DataFrame) -> str:
    """Return one line with the count of each verdict."""
    told = ", ".join(f"{count} {verdict}" for verdict, count in counts(comparison).items())
    stand_ins = (comparison["reason"] == STAND_IN).any()
    why = f" (objects of this run are {STAND_IN}s, and only real ones are compared)" if stand_ins else ""
    return f"Of {len(comparison)} printed numbers: {told}{why}."


def counts_table(comparison: pd.DataFrame) -> str:
    """Return the counts of each verdict, a row for each of the paper's tables."""
    lines: list[list] = [["", *VERDICTS], [":--"] + ["--:"] * len(VERDICTS)]
    for table, rows in comparison.groupby("table", sort=False):
        lines.append([_name(table), *(count or "" for count in counts(rows).values())])
    lines.append(["All", *counts(comparison).values()])
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def _name(table: str) -> str:
    return TABLES[table].title if table == TEXT else f"Table {table}: {TABLES[table].title}"


def _rule(tolerances: Mapping[str, Mapping]) -> list[str]:
    return [
        f"Reproduced: the mean here is within {_limits(tolerances, 'reproduced')} of what is printed, its rounding and "
        "printed standard deviation included, or its 95 % interval meets it and is no wider than what is close. "
        f"Close: within {_limits(tolerances, 'close')}, or a wider interval meets it. docs/comparison.md has the whole "
        "rule.",
        f"Times of the paper were measured on {' and '.join(HARDWARE.values())}.",
    ]


def _limits(tolerances: Mapping[str, Mapping], verdict: str) -> str:
    """Return how far a number may be off for this verdict, unit by unit; × stands before a factor."""
    limits = []
    for unit, tolerance in tolerances.items():
        factor = "× " if tolerance.get("factor", False) else ""
        limits.append(f"{factor}{tolerance[verdict]:g} ({unit})")
    return ", ".join(limits)


def _table(rows: pd.DataFrame) -> str:
    numbered = _numbered(rows)
    lines = [_HEADS, [":--"] * 3 + ["--:"] * 4 + [":--"]]
    for row in rows.itertuples():
        mark = f" [{numbered[row.reason]}]" if row.reason else ""
        n = EMPTY if math.isnan(row.reproduced) else str(row.n)
        verdict = f"**{row.verdict}**" if row.verdict in _BOLD else row.verdict
        cells = (row.row, row.column, row.unit, _printed(row), _here(row), n, _difference(row), verdict + mark)
        lines.append([cell.replace("|", "\\|") for cell in cells])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _printed(row) -> str:
    digits = max(row.decimals, 0)
    upper = "" if math.isnan(row.upper) else f" to {row.upper:.{digits}f}"
    deviation = "" if math.isnan(row.deviation) else f" (s.d. {row.deviation:g})"
    return f"{row.published:.{digits}f}{upper}{deviation}"


def _here(row) -> str:
    if math.isnan(row.reproduced):
        return EMPTY
    bound = "> " if row.at_least else ""
    value = f"{bound}{_digits(row.reproduced, row.decimals)}"
    if math.isnan(row.ci_low):
        return value
    return f"{value} ({_digits(row.ci_low, row.decimals)} to {_digits(row.ci_high, row.decimals)})"


def _difference(row) -> str:
    if math.isnan(row.reproduced):
        return EMPTY
    if not math.isnan(row.factor):
        return f"× {row.factor:.2g}"
    return f"{row.difference:+.{max(row.decimals, 1)}f}"


def _digits(value: float, decimals: int) -> str:
    """Write the value with the printed decimals, one at least, or with two digits where they leave little of it."""
    short = decimals <= 1 and 0 < abs(value) < 1
    return f"{value:.2g}" if short else f"{value:.{max(decimals, 1)}f}"


def _reasons(rows: pd.DataFrame) -> list[str]:
    lines = [f"{number}. {reason}" for reason, number in _numbered(rows).items()]
    return ["\n".join(lines)] if lines else []


def _numbered(rows: pd.DataFrame) -> dict[str, int]:
    return {reason: number for number, reason in enumerate(dict.fromkeys(r for r in rows["reason"] if r), start=1)}


def _objects(rows: pd.DataFrame) -> list[str]:
    shown = rows[rows["reproduced"].notna()]
    told = []
    for name in ("objects", "hardware"):
        if texts := list(dict.fromkeys(text for text in shown[name] if text)):
            told.append(f"{name.capitalize()} here: {'; '.join(texts)}.")
    return [" ".join(told)] if told else []
