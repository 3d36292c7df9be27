"""Step ``scenes``: settings -> table-top scenes of procedural objects, or of datasets' models, as a BOP dataset."""

from __future__ import annotations

import sys
from dataclasses import replace

from gpca.errors import InputError
from gpca.frames.dataset import (
    Dataset,
    datasets_of,
    distinct_surfaces,
    files_behind,
    models_of,
    simplified,
    untested_surfaces,
)
from gpca.frames.rgbd_scene import SceneSettings, stable_poses, write_scenes
from gpca.objects import procedural
from gpca.objects.canonical import EVALUATION
from gpca.objects.surface import Surface
from gpca.process.job import Job
from gpca.process.provenance import record_provenance

ALL_OBJECTS = "all"


def run(job: Job) -> None:
    """Lay the tables, render them and write the frames."""
    sections = dict(job.settings)
    datasets, role = sections.pop("datasets", None), sections.pop("role", EVALUATION)
    rendered = sections.pop("rendered", ALL_OBJECTS)
    settings = SceneSettings.from_dict(sections)
    inputs = files_behind(datasets, job.data_dir, None) if datasets else []
    with record_provenance([job.out], inputs, job.settings, folders=True):
        if datasets:
            frames = datasets_of(datasets, job.data_dir, job.downloads, None, job.get("splits"), role)
            write_scenes(_models(frames, rendered), job.source, replace(settings, families=()), job.out)
        else:
            surfaces = (surface for family in settings.families for surface in procedural.surfaces(family))
            write_scenes(surfaces, job.source, settings, job.out)


def _models(datasets: dict[str, Dataset], rendered: str) -> list[Surface]:
    """Return the models of objects of the datasets, those that datasets share once.

    Those that cannot be rendered or stood on a table are skipped, with a line on stderr.

    Args:
        rendered: all that the frames show, or those that no frame shows which may be tested.

    Raises:
        InputError: none is left.
    """
    models = []
    is_all = rendered == ALL_OBJECTS
    for surface in distinct_surfaces(models_of(datasets)) if is_all else untested_surfaces(datasets):
        try:
            model = simplified(surface)
            stable_poses(model)
        except InputError as fault:
            print(f"skipped: {fault}", file=sys.stderr)
        else:
            models.append(model)
    if not models:
        which = "no model of them" if is_all else "no model of an object that is not tested"
        choice = "" if is_all else ".objects to all, or virtual"
        remedy = f"set real_world.virtual{choice} to null, or name other datasets"
        raise InputError("real_world.datasets", f"{which} can be rendered on a table", remedy)
    return models
