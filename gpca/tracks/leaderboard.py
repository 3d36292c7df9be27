"""The leaderboard: submitted predictions among the published rows, as one page whose tables can be sorted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gpca.io.files import whole_file
from gpca.tracks.published import FOLDER as PUBLISHED
from gpca.tracks.published import Published
from gpca.tracks.scoring import score
from gpca.tracks.submission import NO_LINK, Submission, read_submission, track_in_head
from gpca.tracks.table import table_of
from gpca.tracks.track import TRACKS

FOLDER = PUBLISHED.parent  # in which the submissions are
TEMPLATE = "leaderboard.html.jinja"
OURS = {"authors": "this repository"}
SAID = ("authors", "seconds", "hardware")  # columns that come from the heads of submissions


@dataclass(frozen=True)
class Board:
    """The table of a track, as the page shows it.

    Attributes:
        title: of the track.
        heads: of the columns.
        labels: how many of these are words; the others are sorted as numbers.
        rows: of cells ``{text, value, link, bold}`` each, and whether the row was submitted.
        notes: below the table.
    """

    title: str
    heads: Sequence[str]
    labels: int
    rows: Sequence[tuple[bool, Sequence[Mapping[str, Any]]]]
    notes: Sequence[str]


def read_submissions(folder: Path) -> tuple[dict[str, list[Submission]], list[str]]:
    """Return the submissions of a folder by track, and the faults of all files, a line each."""
    submissions: dict[str, list[Submission]] = {}
    published: dict[str, Published] = {}
    faults: list[str] = []
    for path in sorted(folder.glob("*.csv")):
        track = track_in_head(path)
        if track not in published:
            published[track] = Published.load(TRACKS[track])
        submission, own = read_submission(path, published[track])
        faults += own
        if submission is not None:
            submissions.setdefault(track, []).append(submission)
    return submissions, faults


def write_page(submissions: Mapping[str, Sequence[Submission]], path: Path) -> None:
    """Write the page of all tracks that are published."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    boards = [
        board_of(Published.load(track), submissions.get(name, ()))
        for name, track in TRACKS.items()
        if (PUBLISHED / f"{name}.npz").is_file()
    ]
    loader = FileSystemLoader(Path(__file__).parent)
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    with whole_file(path) as partial:
        partial.write_text(environment.get_template(TEMPLATE).render(boards=boards), encoding="utf-8")


def board_of(published: Published, submissions: Sequence[Submission]) -> Board:
    """Return the table of a track with submissions among the published rows."""
    heads = {submission.method.name: submission.head for submission in submissions}
    scores, _ = score(published, {submission.method.name: submission.method for submission in submissions})
    mine = {submission.method.name: submission.method for submission in submissions}
    table = table_of(published, mine, scores, scores.iloc[:0])
    printed = table.printed()
    columns = [name for name, column in table.columns.items() if not column.beside]
    labels = printed["label_columns"]
    rows = []
    for row, (keys, cells) in enumerate(zip(table.rows, printed["rows"], strict=True)):
        name = next(key for key, _ in keys[-2:-1])
        head = heads.get(name, OURS)
        link = head.get("link", NO_LINK)
        words = [{"text": text, "value": text, "bold": bold} for text, bold in cells[:labels]]
        words[-2] |= {"link": link} if link != NO_LINK else {}
        numbers = [
            {"text": text, "bold": bold, "value": table.cells[row, column].mean if (row, column) in table.cells else ""}
            for column, (text, bold) in zip(columns, cells[labels:], strict=True)
        ]
        said = [{"text": head.get(key, "–"), "bold": False, "value": head.get(key, "")} for key in SAID]
        rows.append((name in heads, [*words, *numbers, *said]))
    title = f"{published.track.name}: {published.track.title}"
    notes = [f"Samples {published.version}.", *table.footnotes]
    return Board(title, [*printed["heads"], *(key.capitalize() for key in SAID)], labels, rows, notes)
