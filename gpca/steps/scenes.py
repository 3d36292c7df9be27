"""Step ``scenes``: settings -> table-top scenes of procedural objects as a BOP dataset."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.errors import InputError
from gpca.frames.rgbd_scene import SceneSettings, write_scenes
from gpca.objects import procedural
from gpca.provenance import record_provenance
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` is the config's section ``real_world.scenes``."""
    parser.add_argument("--source", required=True, help="name of the source, which seeds the draws")
    parser.add_argument("--out", required=True, type=Path, help="output folder; an existing one is replaced")


def run(options: Namespace) -> None:
    """Lay the tables, look at them and write what was seen."""
    check_settings(options.settings, "real_world", "scenes")
    # It is replaced as a whole, so it has to be one that this step has written.
    provenance = Path(f"{options.out.absolute()}.provenance.json")
    if options.out.is_dir() and any(options.out.iterdir()) and not provenance.is_file():
        raise InputError(options.out, "exists but was not made by this step", "name another folder or empty it")
    settings = SceneSettings.from_dict(options.settings)
    with record_provenance([options.out], [], options.settings, folders=True):
        surfaces = (surface for family in settings.families for surface in procedural.surfaces(family))
        write_scenes(surfaces, options.source, settings, options.out)
