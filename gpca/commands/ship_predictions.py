"""Command ``ship-predictions``: a finished run -> what is shipped of the tracks of its samples; for releases."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.config.check import read
from gpca.config.layers import read_file, with_defaults
from gpca.errors import InputError
from gpca.tracks.published import FOLDER
from gpca.tracks.shipping import collect
from gpca.tracks.track import DEFAULT, TRACKS, track_of

LARGEST_BYTES = 10**7  # of all tracks together, as they are kept in git


def add_arguments(parser: ArgumentParser) -> None:
    """Declare folders."""
    folder = Path("results") / DEFAULT
    parser.add_argument(
        "--run", dest="folder", type=Path, default=folder, help=f"folder of the run (default: {folder})"
    )
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder to write them to")
    of_default = [name for name, track in TRACKS.items() if track.run == DEFAULT]
    words = "; ".join(f"{name} needs the run {track.run}" for name, track in TRACKS.items() if track.run != DEFAULT)
    parser.add_argument(
        "--tracks",
        nargs="+",
        default=of_default,
        help=f"tracks to extract (default: those of the default run; {words})",
    )


def run(options: Namespace) -> None:
    """Write a file for each track; the same run gives the same bytes."""
    if options.settings:
        raise InputError("--settings", "is not used by ship-predictions", "leave it out")
    total = 0
    for track in map(track_of, options.tracks):
        config, _ = read(with_defaults(*map(read_file, track.layers)), {})
        published = collect(track, options.folder, config)
        published.save(path := options.out / f"{track.name}.npz")
        total += path.stat().st_size
        print(f"{path}: {len(published.methods)} methods, {len(published.rows)} samples, version {published.version}")
    if total > LARGEST_BYTES:
        raise InputError(options.out, f"has {total / 1e6:.1f} MB, more than {LARGEST_BYTES / 1e6:g}", "leave rows out")
