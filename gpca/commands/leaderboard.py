"""Command ``leaderboard``: submitted predictions -> a page that ranks them among the published rows."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.errors import InputError
from gpca.io.files import require_outputs
from gpca.tracks.leaderboard import FOLDER, read_submissions, write_page


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the folder and the page."""
    parser.add_argument(
        "--submissions", type=Path, default=FOLDER, help="folder of CSV files (default: results/leaderboard)"
    )
    parser.add_argument("--out", type=Path, help="the page (default: index.html in that folder)")
    parser.add_argument("--check", action="store_true", help="only check the files")


def run(options: Namespace) -> int:
    """Check all submissions and write the page; each fault is a line on stderr, and the status is then 2."""
    if options.settings:
        raise InputError("--settings", "is not used by leaderboard", "leave it out")
    page = options.out or options.submissions / "index.html"
    if not options.check:
        require_outputs([page])
    submissions, faults = read_submissions(options.submissions)
    if faults:
        print(*faults, sep="\n", file=sys.stderr)
        return 2
    counts = ", ".join(f"{len(of)} of the track {track}" for track, of in submissions.items()) or "none"
    print(f"submissions: {counts}")
    if not options.check:
        write_page(submissions, page)
        print(page)
    return 0
