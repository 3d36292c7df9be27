"""Step ``objects``: one configured source -> ``objects/{source}.npz``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.objects.canonical import write_objects
from gpca.objects.source import data_files, resolve, surfaces
from gpca.process.arguments import SURFACE_POINTS
from gpca.process.provenance import record_provenance
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` is the source's entry of the config."""
    parser.add_argument("--source", required=True, help="name of the source, which seeds the draws")
    parser.add_argument("--data-dir", help="folder with the data; what is there is not downloaded")
    parser.add_argument("--downloads", default="data/downloads", help="where downloads are kept")
    parser.add_argument("--surface-points", type=SURFACE_POINTS, default=16384, help="points sampled on each mesh")
    parser.add_argument("--out", required=True, type=Path)


def run(options: Namespace) -> None:
    """Read the source's surfaces, sample them and write the canonical clouds."""
    check_settings(options.settings, "sources", "*")
    entry = resolve(options.settings, options.data_dir)
    declared = {"entry": entry, "surface_points": options.surface_points}
    with record_provenance([options.out], data_files(entry), declared):
        write_objects(surfaces(entry, Path(options.downloads)), options.source, options.out, options.surface_points)
