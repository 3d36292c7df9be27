"""Step ``scenes``: settings -> table-top scenes of procedural objects, or of datasets' models, as a BOP dataset."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path

from gpca.errors import InputError
from gpca.frames.meshes import datasets_of, files_behind, models_of, simplified
from gpca.frames.reading import distinct_surfaces
from gpca.frames.resting import stable_poses
from gpca.frames.rgbd_scene import SceneSettings, write_scenes
from gpca.objects import procedural
from gpca.objects.surface import Surface
from gpca.process.provenance import record_provenance
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` is the section ``real_world.scenes``, and perhaps ``datasets``."""
    parser.add_argument("--source", required=True, help="name of the source, which seeds the draws")
    parser.add_argument("--data-dir", help="folder with the datasets; what is there is not downloaded")
    parser.add_argument("--downloads", default="data/downloads", type=Path, help="where downloads are kept")
    parser.add_argument("--out", required=True, type=Path, help="output folder; an existing one is replaced")


def run(options: Namespace) -> None:
    """Lay the tables, look at them and write what was seen."""
    given = dict(options.settings)
    datasets = given.pop("datasets", None)
    check_settings(given, "real_world", "scenes")
    check_settings({"datasets": datasets}, "real_world")
    # It is replaced as a whole, so it has to be one that this step has written.
    provenance = Path(f"{options.out.absolute()}.provenance.json")
    if options.out.is_dir() and any(options.out.iterdir()) and not provenance.is_file():
        raise InputError(options.out, "exists but was not made by this step", "name another folder or empty it")
    settings = SceneSettings.from_dict(given)
    inputs = files_behind(datasets, options.data_dir, None) if datasets else []
    with record_provenance([options.out], inputs, options.settings, folders=True):
        if datasets:
            write_scenes(_models(options, datasets), options.source, replace(settings, families=()), options.out)
        else:
            surfaces = (surface for family in settings.families for surface in procedural.surfaces(family))
            write_scenes(surfaces, options.source, settings, options.out)


def _models(options: Namespace, datasets: dict[str, dict]) -> list[Surface]:
    """Return the models of all objects that the datasets' frames show, those that datasets share once.

    Those that cannot be rendered or stood on a table are skipped, with a line on stderr.

    Raises:
        InputError: none is left.
    """
    models = []
    found = datasets_of(datasets, options.data_dir, options.downloads, None)
    for surface in distinct_surfaces(models_of(found)):
        try:
            model = simplified(surface)
            stable_poses(model)
        except InputError as fault:
            print(f"skipped: {fault}", file=sys.stderr)
        else:
            models.append(model)
    if not models:
        remedy = "set real_world.virtual to null, or name other datasets"
        raise InputError("real_world.datasets", "no model of them can be rendered on a table", remedy)
    return models
