"""Step ``frame_causes``: instances of depth frames -> causes of their registrations, measured."""

from __future__ import annotations

from gpca.causes.frames import chosen_starts, measure_frames
from gpca.causes.settings import CauseSettings, FrameCauseSettings
from gpca.frames.dataset import datasets_of, files_behind, meshes_of, models_of
from gpca.frames.instances import Instances, require_of_objects
from gpca.frames.starts import all_starts
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import EVALUATION, ObjectClouds
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.settings import read_settings


def run(job: Job) -> None:
    """Choose the starts, register the instances from each, and measure what made them fail."""
    frames = files_behind(job.section("datasets"), job.data_dir, job.get("scenes"))
    inputs, outputs = [job.instances, job.objects, *frames], [job.frame_causes, job.samples, job.starts]
    with record_provenance(outputs, inputs, job.settings, seed=job.seed):
        instances, objects = (
            Instances.load(job.instances, (job.source, None)),
            ObjectClouds.load(job.objects, job.source),
        )
        require_of_objects(instances, objects, job.instances)
        own = read_settings(FrameCauseSettings, job.section("frames"))
        places = job.get("scenes"), job.get("splits"), job.settings.get("role", EVALUATION)
        datasets = datasets_of(job.section("datasets"), job.data_dir, job.downloads, *places)
        models = models_of(datasets)
        starts = chosen_starts(all_starts(instances, objects, datasets, models, own.rungs), instances, job.source, own)
        meshes = meshes_of(models, objects, instances.object_index[starts.instance].tolist())
        settings = CauseSettings.from_dict(job.section("causes"), job.section("icp"))
        axes = (job.source, job.seed)
        causes, samples = measure_frames(instances, starts, objects, meshes, *axes, settings, own.points)
        seen = zip(samples["dataset"], samples["scene"], strict=True)
        causes.save(job.frame_causes)
        write_csv(job.samples, samples.assign(truth=[datasets[name].place(scene).truth for name, scene in seen]))
        starts.subset(causes.registrations.sample).save(job.starts, axes)
