"""Writes the comparison as Markdown: how often each verdict and chance, then a table for each of the paper's."""

import math
from collections.abc import Iterable, Mapping

from gpca.comparison.chance import ALL, SHUFFLES, chance
from gpca.comparison.published import HARDWARE, TEXT, table_in_words
from gpca.comparison.verdicts import DECIDED, LOWER_BOUND, PAPER_TOO_WIDE, VERDICTS, Tolerance, counts, judged_once
from gpca.io.frame import Frame
from gpca.objects.entry import STAND_IN
from gpca.reporting.tables.table import EMPTY
from gpca.reporting.words import span

_HEADS = ("Row", "Column", "Unit", "Paper", "Here", "Over objects", "n", "n needed", "Difference", "Verdict")
_CHANCE = ("by chance", "p", "ρ")


def comparison_markdown(comparison: Frame, tolerances: Mapping[str, Tolerance]) -> str:
    """Return the page of what :func:`gpca.comparison.verdicts.compare` returns, with the tolerances of each unit."""
    parts = ["# Published and reproduced", summary(comparison), counts_table(comparison, tolerances)]
    if (by_chance := chance(comparison, tolerances).get(ALL)) is not None:
        parts.append(
            f"{by_chance.agree} numbers are reproduced or close; {by_chance.expected:.1f} would be by chance, if the "
            f"values here were shuffled within their columns (mean of {SHUFFLES} shuffles). p is the share of shuffles "
            f"that reach the actual number, {by_chance.p:.2f} for all tables together. ρ is Spearman's rank "
            "correlation of printed and reproduced values, with ranks taken within each column."
        )
    sign = {unit: "× " if tolerance.factor else "" for unit, tolerance in tolerances.items()}
    near = ", ".join(f"{sign[unit]}{tolerance.reproduced:g} ({unit})" for unit, tolerance in tolerances.items())
    far = ", ".join(f"{sign[unit]}{tolerance.close:g} ({unit})" for unit, tolerance in tolerances.items())
    parts.append(
        f"Reproduced: the mean here is within {near} of the printed number, or the 95 % interval of the difference "
        f"contains 0. Close: within {far}. Inconclusive: the interval reaches beyond what is close, but does not lie "
        "beyond it as a whole; n needed is the number of seeds with the same mean and spread that would decide. "
        "Intervals are over seeds and samples with the objects fixed (docs/comparison.md)."
    )
    parts.append(f"Times of the paper were measured on {' and '.join(HARDWARE.values())}.")
    for table, rows in comparison.groupby("table", sort=False):
        number_of = {reason: number for number, reason in enumerate(_distinct(rows["reason"]), start=1)}
        parts += [f"## {table_in_words(table)}", _table(rows, number_of)]
        parts.append("\n".join(f"{number}. {reason}" for reason, number in number_of.items()))
        shown = rows[rows["reproduced"].notna()]
        seen_on = {name: "; ".join(_distinct(shown[name])) for name in ("objects", "hardware")}
        parts.append(" ".join(f"{name.capitalize()} here: {texts}." for name, texts in seen_on.items() if texts))
    return "\n\n".join(part for part in parts if part) + "\n"


def summary(comparison: Frame) -> str:
    """Return the counts: means, each value once, decided or not; standard deviations and repeats apart."""
    once, deviations, repeats = _parts(comparison)
    is_decided = once["verdict"].isin(DECIDED)

    def in_words(rows: Frame) -> str:
        return ", ".join(f"{count} {verdict}" for verdict, count in counts(rows).items() if count)

    parts = [f"{is_decided.sum()} decided ({in_words(once[is_decided])})"] if is_decided.any() else []
    parts += [in_words(once[~is_decided])] if not is_decided.all() else []
    sentences = [f"Of {len(comparison)} printed numbers, {len(once)} are means, each judged once: {', '.join(parts)}."]
    kinds = []
    if by_paper := (once["reason"] == PAPER_TOO_WIDE).sum():
        kinds.append(f"no run can decide {by_paper}, as the paper's own interval is too wide")
    if bounds := (once["reason"] == LOWER_BOUND).sum():
        kinds.append(f"{bounds} are lower bounds, which need a larger pool")
    if len(needed := once["n_needed"].dropna()):
        kinds.append(f"{len(needed)} need {span(needed)} seeds")
    if kinds:
        sentences.append(f"Of the inconclusive means, {'; '.join(kinds)}.")
    if len(deviations):
        sentences.append(f"{len(deviations)} are standard deviations: {in_words(deviations)}.")
    if len(repeats):
        sentences.append(f"{len(repeats)} repeat values that are already judged: {in_words(repeats)}.")
    if (comparison["reason"] == STAND_IN).any():
        sentences.append(f"The objects of this run are {STAND_IN}s, and only real ones are compared.")
    return " ".join(sentences)


def counts_table(comparison: Frame, tolerances: Mapping[str, Tolerance]) -> str:
    """Return the counts of each verdict, a row for each of the paper's tables, beside what shuffled values reach."""
    once, deviations, repeats = _parts(comparison)
    by_chance = chance(comparison, tolerances)

    def cells(table: str) -> list[str]:
        if (of := by_chance.get(table)) is None:
            return [""] * len(_CHANCE)
        p, rho = (EMPTY if math.isnan(value) else f"{value:.2f}" for value in (of.p, of.rho))
        return [f"{of.expected:.1f}", p, rho]

    lines: list[list] = [["", *VERDICTS, *_CHANCE], [":--"] + ["--:"] * len(VERDICTS + _CHANCE)]
    for table, rows in once.groupby("table", sort=False):
        lines.append([table_in_words(table), *(count or "" for count in counts(rows).values()), *cells(table)])
    lines.append(["All", *counts(once).values(), *cells(ALL)])
    over_objects = once.assign(verdict=once["over_objects"])
    apart = {"All, by intervals over objects too": over_objects, "Standard deviations": deviations, "Repeats": repeats}
    for name, rows in apart.items():
        if len(rows):
            lines.append([name, *(count or "" for count in counts(rows).values()), "", "", ""])
    return _joined(lines)


def _parts(comparison: Frame) -> tuple[Frame, Frame, Frame]:
    """Return means judged once, standard deviations, and repeats."""
    repeats = comparison["repeat_of"] != ""
    return judged_once(comparison), comparison[(comparison["statistic"] == "deviation") & ~repeats], comparison[repeats]


def _distinct(texts: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(text for text in texts if text))


def _joined(lines: Iterable[Iterable]) -> str:
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def _table(rows: Frame, number_of: Mapping[str, int]) -> str:
    lines = [list(_HEADS), [":--"] * 3 + ["--:"] * 6 + [":--"]]
    for row in rows.fillna({"n_needed": 0}).itertuples():
        mark = f" [{number_of[row.reason]}]" if row.reason else ""
        if row.repeat_of:
            table, _, cell = row.repeat_of.partition(" / ")
            mark += f" (repeat of {'' if table == TEXT else 'Table '}{table}, {cell})"
        digits = max(row.decimals, 0)
        printed = f"{row.published:.{digits}f}"
        printed += "" if math.isnan(row.upper) else f" to {row.upper:.{digits}f}"
        printed += "" if math.isnan(row.deviation) else f" (s.d. {row.deviation:g})"
        if not math.isnan(row.paper_low):
            printed += f" ({row.paper_low:.{digits}f} to {row.paper_high:.{digits}f})"
        here = n = difference = over_objects = EMPTY
        if not math.isnan(row.reproduced):
            here, n = f"{'> ' if row.at_least else ''}{_digits(row.reproduced, row)}", str(row.n)
            here += "" if math.isnan(row.ci_low) else f" ({_digits(row.ci_low, row)} to {_digits(row.ci_high, row)})"
            difference = f"{row.difference:+.{max(row.decimals, 1)}f}"
            difference = difference if math.isnan(row.factor) else f"× {row.factor:.2g}"
        if not math.isnan(row.cluster_low):
            over_objects = f"{_digits(row.cluster_low, row)} to {_digits(row.cluster_high, row)}"
        verdict = f"**{row.verdict}**" if row.verdict == VERDICTS[0] else row.verdict
        needed = f"{row.n_needed:.0f}" if row.n_needed else EMPTY
        cells = (row.row, row.column, row.unit, printed, here, over_objects, n, needed, difference, verdict + mark)
        lines.append([cell.replace("|", "\\|") for cell in cells])
    return _joined(lines)


def _digits(value: float, row) -> str:
    """Write the value with the printed decimals, one at least, or with two digits where they leave little of it."""
    short = row.decimals <= 1 and 0 < abs(value) < 1
    return f"{value:.2g}" if short else f"{value:.{max(row.decimals, 1)}f}"
