"""The table of a track, submitted methods among the published ones, as text and as a page with sortable tables."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gpca.causes.judged import CEILING, SMALLER_IS_BETTER
from gpca.errors import InputError
from gpca.evaluation.intervals import REPEATS
from gpca.evaluation.measures import POOLED
from gpca.experiments.cause_tables import AGAIN, SHOWN
from gpca.experiments.frame_causes import FEWEST_FAILURES, STARTS, STATE
from gpca.experiments.scan_failures import COLUMNS as SCAN_COLUMNS
from gpca.experiments.scan_failures import NOT_COMPARED
from gpca.io.frame import Frame
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.cells import interval_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.tracks.overall import overall
from gpca.tracks.published import FOLDER as PUBLISHED
from gpca.tracks.published import NO_CALLS, Method, Published
from gpca.tracks.scoring import AGAINST, counts, score
from gpca.tracks.submission import NO_LINK, Submission, read_head, read_submission
from gpca.tracks.track import CAUSES_TRACK, FRAMES_TRACK, HARD_TRACK, SCANS_TRACK, TRACKS

FOLDER = PUBLISHED.parent  # of the submissions
OURS = {"authors": "this repository"}
HEAD_COLUMNS = ("authors", "seconds", "hardware")  # from the heads of submissions
MARK = "→ "  # before the title of a submitted method
POINTS = ("auroc_failed", "auroc_error", "nominal_calibration")  # measures that are not printed in %
OF_CAUSES = ("tied_accuracy", "regret", "auroc_failed")
COLUMNS: Mapping[str, Mapping[str, Column]] = {
    CAUSES_TRACK: {name: SHOWN[name] for name in ("balanced_accuracy", "dominant_accuracy", *OF_CAUSES)},
    HARD_TRACK: {
        "accuracy": Column("Accuracy (%), chance 33.3"),
        **{f"recall_{concept}": Column(f"Of {concept} (%)", interval=False) for concept in CONCEPTS},
        "auroc_error": Column("AUROC of errors", 2, False, (0.0, 1.0)),
    },
    FRAMES_TRACK: {STATE: Column("State (%)"), **{name: SHOWN[name] for name in OF_CAUSES}},
    SCANS_TRACK: {name: column for name, column in SCAN_COLUMNS.items() if name not in NOT_COMPARED},
}
GROUPS = {**STARTS, POOLED: "All together"}  # titles; data sets keep their names


def table_of(published: Published, submitted: Mapping[str, Method], scores: Frame, against: Frame) -> Table:
    """Return the table of a track with submitted methods, from what :func:`gpca.tracks.scoring.score` returns."""
    track, methods = published.track, {method.name: method for method in published.methods} | dict(submitted)
    columns = dict(COLUMNS[track.name])
    heads = {"group": track.groups} if track.groups else {}
    factor = 1 if track.headline in POINTS else 100
    states_of_group = counts(published)
    table = TableBuilder(f"bench_{track.name}", {**heads, "method": "Method", "reads": "Reads"})
    for group in dict.fromkeys(scores["group"]):
        group_scores = rows_where(scores, group=group)
        # The best first, then those without a headline, and the ceiling last.
        values = rows_where(group_scores, metric=track.headline).set_index("method")["value"].to_dict()
        sign = 1 if track.headline in SMALLER_IS_BETTER else -1
        names = dict.fromkeys(group_scores["method"])
        for name in sorted(names, key=lambda name: (name == CEILING, sign * values.get(name, sign * np.inf))):
            rows = rows_where(group_scores, method=name).set_index("metric")
            cells: dict[str, Cell | None] = {
                metric: interval_cell(rows.loc[metric], factor=1 if metric in POINTS else 100)
                for metric in columns
                if metric in rows.index
            }
            samples, seeds = int(rows["samples"].max()), int(rows["seeds"].max())
            for pair in rows_where(against, group=group, method=name).to_dict("records"):
                value, *bounds = (factor * pair[each] for each in AGAINST[1:])
                cells[f"minus {pair['against']}"] = Cell(value, bounds[1] - value, seeds, samples, bounds=tuple(bounds))
            method = methods.get(name)
            if method is not None and method.icp_calls != NO_CALLS:
                cells["icp_calls"] = plain_cell(method.icp_calls, seeds, samples)
            cells["samples"] = plain_cell(samples, seeds, samples)
            title = AGAIN[CEILING] if method is None else (MARK if name in submitted else "") + method.title
            reads = "truth" if method is None else method.reads or "unknown"
            labels, few = [(name, title), (reads, reads)], ""
            if heads:
                states = {state: states_of_group[group][state] for state in track.required_states}
                few = ": too few" if states and min(states.values()) < FEWEST_FAILURES else ""
                words = ", ".join(f"{count} {state}" for state, count in states.items())
                labels.insert(0, (group, f"{GROUPS.get(group, group)} ({words}{few})"))
            table.add_row(labels, cells, rival=name != CEILING and not few)
    unit, decimals = ("", 3) if factor == 1 else (" (points)", 1)
    for name in submitted:
        title, limits = f"Minus {methods[name].title}{unit}", (-float(factor), float(factor))
        columns[f"minus {name}"] = Column(title, decimals, limits=limits)
    columns |= {"icp_calls": SHOWN["icp_calls"], "samples": SHOWN["samples"]}
    table.compare_down(COLUMNS[track.name], same=len(heads))
    caption = f"Track {track.name}, samples {published.version}: {track.title}"
    footnotes = _footnotes(published, submitted)
    return table.build(caption=caption, column_head="metric", columns=columns, footnotes=footnotes)


def _footnotes(published: Published, submitted: Mapping[str, Method]) -> tuple[str, ...]:
    track, source_N = published.track, published.rows.source
    notes = [f"In brackets: the 95 % interval of {REPEATS} bootstrap draws over {track.clusters}."]
    if submitted:
        notes.append(
            "Minus …: a method's first measure minus that of the new row, on the same draws: the new row is better "
            "where the interval is below 0."
        )
    if track.groups:
        states = " or ".join(track.required_states)
        notes.append(f"Nothing is concluded from fewer than {FEWEST_FAILURES} {states} ones.")
    names = list(dict.fromkeys(source_N.tolist()))
    if track.everywhere:
        notes.append(f"The published rows are of {', '.join(names)}, and have learned from the scenes of all of these.")
    for method in submitted.values() if track.everywhere else ():
        asked = dict.fromkeys(source_N[np.isfinite(method.scores).all(axis=1)].tolist())
        notes += [f"{method.title} is of {', '.join(asked)} alone."] if len(asked) < len(names) else []
    return (*notes, track.measures)


def as_text_among(published: Published, submitted: Mapping[str, Method]) -> str:
    """Return the table of submitted methods among the published ones as text, of the groups that they predict."""
    scores, against = score(published, submitted)
    if submitted:
        groups = scores["group"][scores["method"].isin(list(submitted))]
        scores, against = (rows[rows["group"].isin(groups)] for rows in (scores, against))
    return as_text(table_of(published, submitted, scores, against))


def as_text(table: Table) -> str:
    """Return a table as lines of aligned columns, for a terminal."""
    printed = table.printed()
    rows = [printed["heads"], *([text for text, _ in row] for row in printed["rows"])]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    sides = [str.ljust if column < printed["label_columns"] else str.rjust for column in range(len(widths))]
    lines = []
    for row in rows:
        cells = (align(cell, width) for align, cell, width in zip(sides, row, widths, strict=True))
        lines.append("  ".join(cells).rstrip())
    lines.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join([printed["caption"], "", *lines, "", *printed["footnotes"]])


def read_submissions(folder: Path) -> tuple[dict[str, list[Submission]], list[str]]:
    """Return the submissions of a folder by track, and the first fault of each other file."""
    if not folder.is_dir():
        raise InputError(folder, "no such folder", "name the folder of the submissions")
    submissions: dict[str, list[Submission]] = {}
    published: dict[str, Published] = {}
    faults: list[str] = []
    for path in sorted(folder.glob("*.csv")):
        try:
            track = read_head(path)[0]["track"]
            if track not in published:
                published[track] = Published.load(TRACKS[track])
            submission, rivals = read_submission(path, published[track]), submissions.setdefault(track, [])
            if submission.method.name in [other.method.name for other in rivals]:
                raise InputError(path, "its method has the name of another one", "give it a name of its own")
            rivals.append(submission)
        except InputError as fault:
            faults.append(str(fault))
    return submissions, faults


def boards(submissions: Mapping[str, Sequence[Submission]]) -> list[dict[str, Any]]:
    """Return the board of all tracks, and :func:`board_of` each, with the submissions by the name of the track."""
    shipped = [name for name in TRACKS if (PUBLISHED / f"{name}.npz").is_file()]
    tracks = [(Published.load(TRACKS[name]), submissions.get(name, ())) for name in shipped]
    links = {each.method.name: each.head["link"] for _, sent in tracks for each in sent if each.head["link"] != NO_LINK}
    methods = [(of, {each.method.name: each.method for each in sent}) for of, sent in tracks]
    together, costs = overall(methods, links)
    return [together, *(board_of(*track, links) | {"costs": cost} for track, cost in zip(tracks, costs, strict=True))]


def board_of(published: Published, submissions: Sequence[Submission], links: Mapping[str, str]) -> dict[str, Any]:
    """Return the table of a track as the page shows it: groups of rows of cells {text, bold, link}, method first."""
    head_of = {submission.method.name: submission.head for submission in submissions}
    submitted = {submission.method.name: submission.method for submission in submissions}
    scores, _ = score(published, submitted)
    table = table_of(published, submitted, scores, scores.iloc[:0])
    printed = table.printed()
    has_groups = bool(published.track.groups)
    title_head, reads_head, *heads = printed["heads"][has_groups:]
    groups: dict[str, list[dict[str, Any]]] = {}
    for keys, cells in zip(table.rows, printed["rows"], strict=True):
        name = keys[-2][0]
        head = head_of.get(name, OURS)
        title, reads, *numbers = cells[has_groups:]
        words = [reads, *((head.get(key, "–"), False) for key in HEAD_COLUMNS)]
        shown: list[dict[str, Any]] = [{"text": text, "bold": bold} for text, bold in (title, *numbers, *words)]
        shown[0] |= {"link": links[name]} if name in links else {}
        groups.setdefault(cells[0][0] if has_groups else "", []).append({"submitted": name in head_of, "cells": shown})
    return {
        "title": f"{published.track.name}: {published.track.title}",
        "heads": [title_head, *heads, reads_head, *(key.capitalize() for key in HEAD_COLUMNS)],
        "groups": groups,
        "notes": [f"Samples {published.version}.", *table.footnotes],
    }
