"""Step ``objects``: one configured source -> ``objects/{source}.npz``."""

from __future__ import annotations

from gpca.objects.canonical import write_objects
from gpca.objects.source import data_files, resolve, surfaces
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Read the source's surfaces, sample them and write the canonical clouds."""
    entry = resolve(job.settings, job.data_dir)
    declared = {"entry": entry, "surface_points": job.surface_points}
    splits = job.get("splits")
    with record_provenance([job.out], [*data_files(entry), *filter(None, [splits])], declared):
        write_objects(surfaces(entry, job.downloads), job.source, job.out, job.surface_points, splits)
