"""Step ``frame_registrations``: instances -> ``registrations/{source}/seed{seed}.npz``, and their pose errors."""

from __future__ import annotations

from dataclasses import replace

from gpca.attribution.predictions import write_timings
from gpca.frames.instances import Instances, require_of_objects
from gpca.frames.synthesis import FrameSettings, make_frame_registrations
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.synthesis import RegistrationSettings
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Perturb and align."""
    of_registrations = dict(job.settings)
    own = {name: of_registrations.pop(name) for name in ("test_share", "occluders") if name in of_registrations}
    settings = FrameSettings(**own, registration=RegistrationSettings.from_dict(of_registrations))
    inputs, name = [job.instances, job.objects], job.get("name", job.source)
    with record_provenance([job.registrations, job.poses, job.timings], inputs, job.settings, seed=job.seed):
        instances = Instances.load(job.instances, (name, None))
        objects = ObjectClouds.load(job.objects, name)
        require_of_objects(instances, objects, job.instances)
        made = make_frame_registrations(instances, objects, job.source, job.seed, settings)
        registrations, icp_seconds_S, poses = made
        replace(registrations, axes=(name, job.seed)).save(job.registrations)
        write_csv(job.poses, poses)
        write_timings(job.timings, registrations, icp_seconds_S, icp_seconds_S)
