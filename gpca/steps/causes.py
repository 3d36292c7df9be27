"""Step ``causes``: canonical clouds -> ``causes/{source}/seed{seed}.npz``, registrations with measured causes."""

from __future__ import annotations

from gpca.attribution.predictions import write_timings
from gpca.causes.drawing import draw_causes
from gpca.causes.settings import CauseSettings
from gpca.objects.canonical import ObjectClouds
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Draw candidates, measure their causes, keep a balanced set."""
    own, icp = job.settings_and_icp()
    settings = CauseSettings.from_dict(own, icp)
    objects = ObjectClouds.load(job.objects, job.source)
    outputs = [job.causes, job.candidates, job.timings]
    with record_provenance(outputs, [job.objects], job.settings, seed=job.seed):
        causes, tally, icp_seconds_S = draw_causes(objects, job.source, job.seed, settings)
        causes.save(job.causes)
        tally.save(job.candidates)
        write_timings(job.timings, causes.registrations, icp_seconds_S, icp_seconds_S)
