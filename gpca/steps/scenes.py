"""Step ``scenes``: settings -> table-top scenes of procedural objects, or of datasets' models, as a BOP dataset."""

from __future__ import annotations

import sys
from dataclasses import replace

from gpca.errors import InputError
from gpca.frames.meshes import datasets_of, files_behind, models_of, simplified
from gpca.frames.reading import distinct_surfaces
from gpca.frames.resting import stable_poses
from gpca.frames.rgbd_scene import SceneSettings, write_scenes
from gpca.objects import procedural
from gpca.objects.surface import Surface
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Lay the tables, render them and write the frames."""
    sections = dict(job.settings)
    datasets = sections.pop("datasets", None)
    settings = SceneSettings.from_dict(sections)
    inputs = files_behind(datasets, job.data_dir, None) if datasets else []
    with record_provenance([job.out], inputs, job.settings, folders=True):
        if datasets:
            write_scenes(_models(job, datasets), job.source, replace(settings, families=()), job.out)
        else:
            surfaces = (surface for family in settings.families for surface in procedural.surfaces(family))
            write_scenes(surfaces, job.source, settings, job.out)


def _models(job: Job, datasets: dict[str, dict]) -> list[Surface]:
    """Return the models of all objects that the datasets' frames show, those that datasets share once.

    Those that cannot be rendered or stood on a table are skipped, with a line on stderr.

    Raises:
        InputError: none is left.
    """
    models = []
    frames = datasets_of(datasets, job.data_dir, job.downloads, None)
    for surface in distinct_surfaces(models_of(frames)):
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
