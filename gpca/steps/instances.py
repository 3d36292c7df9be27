"""Step ``instances``: BOP datasets -> ``instances/{source}.npz`` and the canonical clouds of their models."""

from __future__ import annotations

import sys

from gpca.frames.dataset import datasets_of, distinct_surfaces, files_behind, read_models, with_shared_models
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.instances import points_on_model, read_instances
from gpca.objects.canonical import EVALUATION, sample_objects
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Read models and frames, back-project the masks and find the initial poses."""
    datasets = datasets_of(
        job.settings.get("datasets"),
        job.data_dir,
        job.downloads,
        job.get("scenes"),
        job.get("splits"),
        job.settings.get("role", EVALUATION),
    )
    inputs = files_behind(job.settings.get("datasets"), job.data_dir, job.get("scenes"))
    initial_pose = InitialPoseSettings(**job.settings.get("initial_pose", {}))
    declared = {**job.settings, "surface_points": job.surface_points}
    with record_provenance([job.instances, job.objects], inputs, declared):
        frames = {name: dataset.frames() for name, dataset in datasets.items()}
        models = with_shared_models({name: read_models(datasets[name], shown) for name, shown in frames.items()})
        objects = sample_objects(distinct_surfaces(models), job.source, job.surface_points)
        read = {name: (dataset, frames[name], models[name]) for name, dataset in datasets.items()}
        instances = read_instances(read, objects, initial_pose)
        named = job.get("name", job.source)
        objects.save(job.objects, named)
        instances.save(job.instances, (named, None))
    for name in datasets:
        medians_m = points_on_model(instances, objects)[instances.dataset == name]
        print(
            f"{name}: {len(medians_m)} instances; median distance to the model under the true pose: "
            f"{1e3 * medians_m.mean():.2f} mm on average, {1e3 * medians_m.max():.2f} mm at most",
            file=sys.stderr,
        )
