"""Step ``measure_joint``: development samples of some severities -> the values under joint readings."""

from __future__ import annotations

from gpca.evaluation.measures import tidy, write_metrics
from gpca.experiments.joint_reading.joint_values import values
from gpca.experiments.joint_reading.measured_samples import MeasureSettings, Subjects
from gpca.objects.canonical import ObjectClouds
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Measure every combination of the other choices."""
    axes = (job.source, job.seed)
    settings, sizes = MeasureSettings.of_job(job), job.section("sizes")
    with record_provenance([job.out], [job.objects, job.sets], job.settings, seed=job.seed):
        objects = ObjectClouds.load(job.objects, job.source)
        subjects = Subjects.load(objects, job.sets, axes, job.section("registrations"), sizes["samples"])
        measured = values(subjects, job.severities, job.section("choices"), settings)
        records = [(part, job.source, *named, job.seed, value) for part, *named, value in measured]
        write_metrics(tidy(records, "joint readings"), job.out)
