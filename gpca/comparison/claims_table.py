"""The paper's claims in sentences, with the differences in this run that support or refute each."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from gpca.comparison.claims import CLAIM_VERDICTS
from gpca.comparison.verdicts import NOT_RUN
from gpca.io.frame import Frame
from gpca.objects.entry import title_of
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural, span

COMPONENTS = "components"  # of the runtime
HEADS = {"claim": "The paper", "claim_verdict": "Verdict", "source": "Dataset", "table": "Samples"}
HEADS |= {"compared": "Compared", "expected": "Expected", "verdict": "Holds"}
_TESTS = {"greater": "greater", "less": "less", "not_worse": "not worse", "equivalent": "the same"}
_RULE = (
    "of differences of the same seed, or of accuracies the farther bounds of it and of one over clusters of objects or "
    "scenes. A sentence is supported if all of its comparisons are, and refuted or smaller than the margin if one is, "
    "by an interval that allows for their number. Smaller than the margin: not below 0, but below what is expected. "
    "Floor: both are at the first labels, so the difference is unknown. Not worse and the same: the whole interval "
    "lies within the margin. docs/comparison.md has the whole rule."
)


@dataclass(frozen=True)
class DifferenceColumn(Column):
    """Shows a difference, or a factor, with the bounds of its interval and three digits."""

    def text(self, cell: Cell) -> str:
        """Return e.g. ``-1.2 (-2.1 to 0.3)``."""
        low, high = cell.bounds or (math.nan, math.nan)
        interval = "" if math.isnan(low) else f" ({low:.3g} to {high:.3g})"
        return f"{cell.mean:.3g}{interval}"


def claims(verdicts: Frame, sources: Mapping[str, Mapping], titles: Mapping[str, str]) -> Table:
    """Return a row per comparison, below the sentence that it belongs to; titles are those of methods."""

    def titled(name: str) -> str:
        method, _, concept = name.partition(" ")
        return f"{titles[method]} {concept}".rstrip() if method in titles else name

    table = TableBuilder("claims", HEADS)
    seen: set[str] = set()
    for row in verdicts[verdicts["verdict"] != NOT_RUN].itertuples():
        first, margin = row.claim not in seen, float(row.margin)
        seen.add(row.claim)
        unit = "" if row.unit in ("correlation", "risk", "share") else f" {row.unit}"
        by = f", by × {margin:g}" if row.ratio == "True" else f", by {margin:g}{unit}" if margin else ""
        table.add_row(
            [
                (row.claim, f"{row.sentence} ({row.place})" if first else ""),
                (row.claim_verdict, row.claim_verdict if first else ""),
                (row.source, title_of(sources[row.source]) if row.source in sources else row.source),
                (row.table, row.table.rpartition("/")[2].replace("_", " ")),
                (f"{row.one} against {row.other}", f"{titled(row.one)} against {titled(row.other)}"),
                (row.test, _TESTS[row.test] + by),
                (row.verdict, f"{row.verdict} (floor)" if row.at_floor == "True" else row.verdict),
            ],
            {"difference": Cell(row.value, row.high - row.value, int(row.n), 0, bounds=(row.low, row.high))},
        )
    # The components' times are of repeats.
    by_seed = verdicts[verdicts["n"].notna() & (verdicts["table"] != COMPONENTS)]
    seeds = plural(span(by_seed["n"]), "seed") if len(by_seed) else "repeats"
    not_run = verdicts[verdicts["claim_verdict"] == NOT_RUN].drop_duplicates("claim").itertuples()
    return table.build(
        caption="What the paper says in sentences, and whether the differences in this run support it",
        column_head="quantity",
        columns={"difference": DifferenceColumn("First minus second, or their ratio", limits=(-math.inf, math.inf))},
        footnotes=(
            counted(verdicts),
            f"In brackets: the 95 % interval over {seeds} {_RULE}",
            *margins_in_words(verdicts),
            *(f"Not run: {row.sentence} ({row.place}){': ' if row.note else ''}{row.note}." for row in not_run),
        ),
    )


def counted(verdicts: Frame) -> str:
    """Return how many sentences have each verdict, in words."""
    counts = verdicts.drop_duplicates("claim")["claim_verdict"].value_counts(sort=False)
    phrases = (f"{counts[verdict]} {verdict}" for verdict in CLAIM_VERDICTS if verdict in counts)
    return f"Of {counts.sum()} sentences: {', '.join(phrases)}."


def margins_in_words(verdicts: Frame) -> list[str]:
    """Return a sentence on when the margins of the claims were set, and what was known by then."""
    once = verdicts.drop_duplicates("claim")
    phrases = []
    for (day, seen), day_rows in once[once["test"] != ""].groupby(["margin_set", "values_known"], sort=True):
        before = "after the differences had been seen" if seen == "True" else "before the differences were looked at"
        phrases.append(f"{len(day_rows)} on {day}, {before}")
    return [f"Margins were set for {'; '.join(phrases)}."] if phrases else []
