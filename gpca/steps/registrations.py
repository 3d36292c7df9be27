"""Step ``registrations``: canonical clouds -> ``registrations/{source}/seed{seed}.npz``."""

from __future__ import annotations

from gpca.attribution.predictions import write_timings
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.synthesis import RegistrationSettings, make_registrations
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Perturb and align."""
    settings = RegistrationSettings.from_dict(job.settings)
    objects = ObjectClouds.load(job.objects, job.source)
    with record_provenance([job.registrations, job.timings], [job.objects], job.settings, seed=job.seed):
        registrations, icp_seconds_S = make_registrations(objects, job.source, job.seed, settings)
        registrations.save(job.registrations)
        write_timings(job.timings, registrations, icp_seconds_S, icp_seconds_S)
