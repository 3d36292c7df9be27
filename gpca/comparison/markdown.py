"""Writes the comparison as Markdown: how often each verdict and chance, then a table for each of the paper's."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from gpca.comparison.chance import ALL, SHUFFLES, Chance, chance
from gpca.comparison.published import HARDWARE, TABLES, TEXT
from gpca.comparison.verdicts import VERDICTS, Tolerance, counts, judged_once
from gpca.objects.entry import STAND_IN
from gpca.reporting.tables.table import EMPTY

if TYPE_CHECKING:
    import pandas as pd

_HEADS = ("Row", "Column", "Unit", "Paper", "Here", "Over objects", "n", "Difference", "Verdict")
_BOLD = (VERDICTS[0],)
_CHANCE = ("by chance", "p", "ρ")


def comparison_markdown(comparison: pd.DataFrame, tolerances: Mapping[str, Tolerance]) -> str:
    """Return the page.

    Args:
        comparison: The frame that :func:`gpca.comparison.verdicts.compare` returns.
        tolerances: The tolerances of each unit.
    """
    parts = ["# Published and reproduced", summary(comparison), counts_table(comparison, tolerances)]
    parts += [_chance_in_words(comparison, tolerances), *_rule(tolerances)]
    for table, rows in comparison.groupby("table", sort=False):
        parts += [f"## {_name(table)}", _table(rows), *_reasons(rows), *_objects(rows)]
    return "\n\n".join(part for part in parts if part) + "\n"


def summary(comparison: pd.DataFrame) -> str:
    """Return the counts: means, each value once, by verdict; standard deviations and repeats apart."""
    once, deviations, repeats = _parts(comparison)
    sentences = [
        f"Of {len(comparison)} printed numbers, {len(once)} are means, each judged once: {_counts_in_words(once)}."
    ]
    if len(deviations):
        sentences.append(f"{len(deviations)} are standard deviations: {_counts_in_words(deviations)}.")
    if len(repeats):
        sentences.append(f"{len(repeats)} repeat values that are already judged: {_counts_in_words(repeats)}.")
    if (comparison["reason"] == STAND_IN).any():
        sentences.append(f"The objects of this run are {STAND_IN}s, and only real ones are compared.")
    return " ".join(sentences)


def counts_table(comparison: pd.DataFrame, tolerances: Mapping[str, Tolerance]) -> str:
    """Return the counts of each verdict, a row for each of the paper's tables, beside what shuffled values reach."""
    once, deviations, repeats = _parts(comparison)
    by_chance = chance(comparison, tolerances)
    lines: list[list] = [["", *VERDICTS, *_CHANCE], [":--"] + ["--:"] * len(VERDICTS + _CHANCE)]
    for table, rows in once.groupby("table", sort=False):
        lines.append([_name(table), *_counted(rows), *_chance_cells(by_chance.get(table))])
    lines.append(["All", *counts(once).values(), *_chance_cells(by_chance.get(ALL))])
    for name, rows in (("Standard deviations", deviations), ("Repeats", repeats)):
        if len(rows):
            lines.append([name, *_counted(rows), "", "", ""])
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def _parts(comparison: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Return means judged once, standard deviations, and repeats."""
    repeats = comparison["repeat_of"] != ""
    return judged_once(comparison), comparison[(comparison["statistic"] == "deviation") & ~repeats], comparison[repeats]


def _counts_in_words(rows: pd.DataFrame) -> str:
    return ", ".join(f"{count} {verdict}" for verdict, count in counts(rows).items() if count)


def _counted(rows: pd.DataFrame) -> list:
    return [count or "" for count in counts(rows).values()]


def _chance_cells(of_table: Chance | None) -> list[str]:
    if of_table is None:
        return [""] * len(_CHANCE)
    p, rho = (EMPTY if math.isnan(value) else f"{value:.2f}" for value in (of_table.p, of_table.rho))
    return [f"{of_table.expected:.1f}", p, rho]


def _chance_in_words(comparison: pd.DataFrame, tolerances: Mapping[str, Tolerance]) -> str:
    of_all = chance(comparison, tolerances).get(ALL)
    if of_all is None:
        return ""
    return (
        f"{of_all.agree} numbers are reproduced or close; {of_all.expected:.1f} would be by chance, if the values here "
        f"were shuffled within their columns (mean of {SHUFFLES} shuffles). p is the share of shuffles that reach the "
        f"actual number, {of_all.p:.2f} for all tables together. ρ is Spearman's rank correlation of printed and "
        "reproduced values, with ranks taken within each column."
    )


def _name(table: str) -> str:
    return TABLES[table].title if table == TEXT else f"Table {table}: {TABLES[table].title}"


def _rule(tolerances: Mapping[str, Tolerance]) -> list[str]:
    return [
        f"Reproduced: the mean here is within {_limits(tolerances, 'reproduced')} of the printed number, or the 95 % "
        f"interval of the difference contains 0. Close: within {_limits(tolerances, 'close')}. Inconclusive: the "
        "interval, which includes the paper's own sampling error where known, reaches beyond what is close, but does "
        "not lie beyond it as a whole. docs/comparison.md has the whole rule.",
        f"Times of the paper were measured on {' and '.join(HARDWARE.values())}.",
    ]


def _limits(tolerances: Mapping[str, Tolerance], verdict: str) -> str:
    """Return how far a number may be off for this verdict, unit by unit; × stands before a factor."""
    return ", ".join(
        f"{'× ' if tolerance.factor else ''}{getattr(tolerance, verdict):g} ({unit})"
        for unit, tolerance in tolerances.items()
    )


def _table(rows: pd.DataFrame) -> str:
    numbered = _numbered(rows)
    lines = [_HEADS, [":--"] * 3 + ["--:"] * 5 + [":--"]]
    for row in rows.itertuples():
        mark = f" [{numbered[row.reason]}]" if row.reason else ""
        mark += f" (repeat of {_short(row.repeat_of)})" if row.repeat_of else ""
        n = EMPTY if math.isnan(row.reproduced) else str(row.n)
        verdict = f"**{row.verdict}**" if row.verdict in _BOLD else row.verdict
        own = (_printed(row), _here(row), _over_objects(row), n, _difference(row), verdict + mark)
        lines.append([cell.replace("|", "\\|") for cell in (row.row, row.column, row.unit, *own)])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _short(key: str) -> str:
    table, _, cell = key.partition(" / ")
    return f"{'' if table == TEXT else 'Table '}{table}, {cell}"


def _over_objects(row) -> str:
    if math.isnan(row.cluster_low):
        return EMPTY
    return f"{_digits(row.cluster_low, row.decimals)} to {_digits(row.cluster_high, row.decimals)}"


def _printed(row) -> str:
    digits = max(row.decimals, 0)
    upper = "" if math.isnan(row.upper) else f" to {row.upper:.{digits}f}"
    deviation = "" if math.isnan(row.deviation) else f" (s.d. {row.deviation:g})"
    own = f" ({row.paper_low:.{digits}f} to {row.paper_high:.{digits}f})"
    return f"{row.published:.{digits}f}{upper}{deviation}{'' if math.isnan(row.paper_low) else own}"


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
    sentences = []
    for name in ("objects", "hardware"):
        if texts := list(dict.fromkeys(text for text in shown[name] if text)):
            sentences.append(f"{name.capitalize()} here: {'; '.join(texts)}.")
    return [" ".join(sentences)] if sentences else []
