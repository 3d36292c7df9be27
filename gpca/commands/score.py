"""Command ``score``: predictions made anywhere -> their row among the published ones."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.errors import InputError
from gpca.tracks.leaderboard import as_text_among
from gpca.tracks.published import Published
from gpca.tracks.submission import read_submission
from gpca.tracks.track import TRACKS, track_of


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the track and the file."""
    parser.add_argument("track", help=f"one of {', '.join(TRACKS)}")
    parser.add_argument("predictions", type=Path, help="CSV with a head of comments (docs/outside.md)")


def run(options: Namespace) -> int:
    """Check and score; each fault is a line on stderr, and the status is then 2."""
    if options.settings:
        raise InputError("--settings", "is not used by score", "leave it out")
    published = Published.load(track_of(options.track))
    submission, faults = read_submission(options.predictions, published)
    if submission is None:
        print(*faults, sep="\n", file=sys.stderr)
        return 2
    print(as_text_among(published, {submission.method.name: submission.method}))
    return 0
