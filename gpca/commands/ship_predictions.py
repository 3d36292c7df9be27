"""Command ``ship-predictions``: a finished run of the default config -> what is shipped of the tracks; for releases."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.config.check import read
from gpca.config.layers import with_defaults
from gpca.errors import InputError
from gpca.tracks.published import FOLDER
from gpca.tracks.shipping import collect
from gpca.tracks.track import TRACKS, track_of

LARGEST_BYTES = 10**7  # of all tracks together, as they are kept in git


def add_arguments(parser: ArgumentParser) -> None:
    """Declare folders."""
    parser.add_argument(
        "--run", dest="folder", type=Path, default=Path("results/default"), help="folder of the run (results/default)"
    )
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder that they go to")
    parser.add_argument("--tracks", nargs="+", default=list(TRACKS), help="which (default: all)")


def run(options: Namespace) -> None:
    """Write a file for each track; the same run gives the same bytes."""
    if options.settings:
        raise InputError("--settings", "is not used by ship-predictions", "leave it out")
    config, _ = read(with_defaults(), {})
    total = 0
    for track in map(track_of, options.tracks):
        published = collect(track, options.folder, config)
        published.save(path := options.out / f"{track.name}.npz")
        total += path.stat().st_size
        print(f"{path}: {len(published.methods)} methods, {len(published.rows)} samples, version {published.version}")
    if total > LARGEST_BYTES:
        raise InputError(options.out, f"has {total / 1e6:.1f} MB, more than {LARGEST_BYTES / 1e6:g}", "leave rows out")
