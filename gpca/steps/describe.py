"""Step ``describe``: causes -> ``descriptors/{source}/seed{seed}.npz``, the descriptors of each pair."""

from __future__ import annotations

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import read_timings, write_timings
from gpca.causes.dataset import Causes
from gpca.causes.descriptors import describe_all
from gpca.causes.settings import DescriptorSettings
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Describe every pair."""
    own, icp = job.settings_and_icp()
    outputs = [job.descriptors, job.timings]
    with record_provenance(outputs, [job.causes, job.causes_timings], job.settings, seed=job.seed):
        causes = Causes.load(job.causes, (job.source, job.seed))
        seconds_S, icp_seconds_S = read_timings(job.causes_timings, causes.registrations)
        settings = DescriptorSettings(**own)
        described, own_S, own_icp_S = describe_all(causes, job.source, job.seed, settings, ICPSettings(**icp))
        described.save(job.descriptors)
        write_timings(job.timings, causes.registrations, seconds_S + own_S, icp_seconds_S + own_icp_S)
