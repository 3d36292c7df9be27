"""The table of a track: new rows among the published ones, best first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.confidence import REPEATS
from gpca.experiments.diagnosis.judged import CEILING, POOLED
from gpca.experiments.diagnosis.measures import SMALLER_IS_BETTER
from gpca.experiments.diagnosis.tables import AGAIN, SHOWN
from gpca.experiments.frame_causes.metrics import STATE
from gpca.experiments.frame_causes.tables import FEWEST_FAILURES, STARTS
from gpca.experiments.scan_causes.tables import COLUMNS as SCAN_COLUMNS
from gpca.experiments.scan_causes.tables import NOT_COMPARED
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.cells import interval_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.tracks.published import NO_CALLS, Method, Published
from gpca.tracks.scoring import counts, score
from gpca.tracks.track import CAUSES_TRACK, FRAMES_TRACK, HARD_TRACK, SCANS_TRACK

if TYPE_CHECKING:
    import pandas as pd

MARK = "→ "  # before the title of a new row
POINTS = ("auroc_failed", "auroc_error", "nominal_calibration")  # measures that are not printed in %
COLUMNS: Mapping[str, Mapping[str, Column]] = {
    CAUSES_TRACK: {
        name: SHOWN[name]
        for name in ("balanced_accuracy", "dominant_accuracy", "tied_accuracy", "regret", "auroc_failed")
    },
    HARD_TRACK: {
        "accuracy": Column("Accuracy (%), chance 33.3"),
        **{f"recall_{concept}": Column(f"Of {concept} (%)", interval=False) for concept in CONCEPTS},
        "auroc_error": Column("AUROC of errors", 2, False, (0.0, 1.0)),
    },
    FRAMES_TRACK: {
        STATE: Column("State (%)"),
        **{name: SHOWN[name] for name in ("tied_accuracy", "regret", "auroc_failed")},
    },
    SCANS_TRACK: {name: column for name, column in SCAN_COLUMNS.items() if name not in NOT_COMPARED},
}
GROUPS = {**STARTS, POOLED: "All together"}  # titles; a data set has its name, as in the files


def as_text_among(published: Published, mine: Mapping[str, Method]) -> str:
    """Return the table of new methods among the published ones, of the groups of samples that they were asked about."""
    scores, against = score(published, mine)
    groups = scores["group"][scores["method"].isin(list(mine))]
    scores, against = (rows[rows["group"].isin(groups)] for rows in (scores, against))
    return as_text(table_of(published, mine, scores, against))


def table_of(published: Published, mine: Mapping[str, Method], scores: pd.DataFrame, against: pd.DataFrame) -> Table:
    """Return the table of a track.

    Args:
        mine: the new methods by name.
        scores, against: what :func:`gpca.tracks.scoring.score` returned.
    """
    track, methods = published.track, {method.name: method for method in published.methods} | dict(mine)
    columns = dict(COLUMNS[track.name])
    heads = {"group": track.groups} if track.groups else {}
    factor = 1 if track.headline in POINTS else 100
    counted = counts(published)
    table = TableBuilder(f"bench_{track.name}", {**heads, "method": "Method", "reads": "Reads"})
    for group in dict.fromkeys(scores["group"]):
        of_group = rows_where(scores, group=group)
        for name in _best_first(of_group, track.headline):
            rows = rows_where(of_group, method=name).set_index("metric")
            cells: dict[str, Cell | None] = {
                metric: interval_cell(rows.loc[metric], factor=1 if metric in POINTS else 100)
                for metric in columns
                if metric in rows.index
            }
            samples, seeds = int(rows["samples"].max()), int(rows["seeds"].max())
            for apart in rows_where(against, group=group, method=name).to_dict("records"):
                bounds = (factor * apart["difference_low"], factor * apart["difference_high"])
                value = factor * apart["difference"]
                cells[_key(apart["against"])] = Cell(value, bounds[1] - value, seeds, samples, bounds=bounds)
            method = methods.get(name)
            if method is not None and method.icp_calls != NO_CALLS:
                cells["icp_calls"] = plain_cell(method.icp_calls, seeds, samples)
            cells["samples"] = plain_cell(samples, seeds, samples)
            title = AGAIN[CEILING] if method is None else (MARK if name in mine else "") + method.title
            reads = "truth" if method is None else method.reads or "not said"
            own = {state: counted[group][state] for state in track.enough_of} if heads else {}
            few = ": too few" if own and min(own.values()) < FEWEST_FAILURES else ""
            words = ", ".join(f"{count} {state}" for state, count in own.items())
            labels = [(group, f"{GROUPS.get(group, group)} ({words}{few})")] if heads else []
            table.add_row([*labels, (name, title), (reads, reads)], cells, rival=name != CEILING and not few)
    for name in mine:
        title, limits = f"Minus {methods[name].title}", (-float(factor), float(factor))
        columns[_key(name)] = (
            Column(title, 3, limits=limits) if factor == 1 else Column(f"{title} (points)", limits=limits)
        )
    columns |= {"icp_calls": SHOWN["icp_calls"], "samples": SHOWN["samples"]}
    table.compare_down(COLUMNS[track.name], same=len(heads))
    return table.build(
        caption=f"Track {track.name}, samples {published.version}: {track.title}",
        column_head="metric",
        columns=columns,
        footnotes=_footnotes(published, mine),
    )


def as_text(table: Table) -> str:
    """Return a table as lines of aligned columns, for a terminal."""
    printed = table.printed()
    rows = [[text for text, _ in row] for row in printed["rows"]]
    widths = [max(map(len, column)) for column in zip(printed["heads"], *rows, strict=True)]
    labels = printed["label_columns"]

    def line(cells: Sequence[str]) -> str:
        placed = zip(cells, widths, strict=True)
        return "  ".join(
            cell.ljust(width) if column < labels else cell.rjust(width) for column, (cell, width) in enumerate(placed)
        ).rstrip()

    rule = "  ".join("-" * width for width in widths)
    return "\n".join(
        [printed["caption"], "", line(printed["heads"]), rule, *map(line, rows), "", *printed["footnotes"]]
    )


def _best_first(rows: pd.DataFrame, headline: str) -> list[str]:
    """Return the methods by their headline, those that have none after them, the ceiling last."""
    values = rows_where(rows, metric=headline).set_index("method")["value"].to_dict()
    sign = 1 if headline in SMALLER_IS_BETTER else -1
    names = [name for name in dict.fromkeys(rows["method"]) if name != CEILING]
    names.sort(key=lambda name: sign * values.get(name, sign * float("inf")))
    return names + ([CEILING] if CEILING in set(rows["method"]) else [])


def _key(against: str) -> str:
    return f"minus {against}"


def _footnotes(published: Published, mine: Mapping[str, Method]) -> tuple[str, ...]:
    track = published.track
    notes = [f"In brackets: the 95 % interval of {REPEATS} bootstrap draws over {track.clusters}."]
    if mine:
        notes.append(
            "Minus …: a method's first measure minus that of the new row, on the same draws: the new row is better "
            "where the interval is below 0."
        )
    if track.groups:
        notes.append(f"Nothing is concluded from fewer than {FEWEST_FAILURES} {' or '.join(track.enough_of)} ones.")
    if track.everywhere:
        notes += _data_sets(published, mine)
    return (*notes, track.measures)


def _data_sets(published: Published, mine: Mapping[str, Method]) -> list[str]:
    """Return of which data sets the rows are, where not everyone has all of them."""
    names = list(dict.fromkeys(published.rows.source.tolist()))
    notes = [f"The published rows are of {', '.join(names)}, and have learned from the scenes of all of these."]
    for method in mine.values():
        asked = dict.fromkeys(published.rows.source[np.isfinite(method.scores).all(axis=1)].tolist())
        if len(asked) < len(names):
            notes.append(f"{method.title} is of {', '.join(asked)} alone.")
    return notes
