"""Step ``reenact``: causes -> ``reenactments/{source}/seed{seed}.npz``, counterfactuals under hypotheses."""

from __future__ import annotations

from gpca.attribution.predictions import read_timings, write_timings
from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.reenactment.dataset import reenact_all
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import read_settings


def run(job: Job) -> None:
    """Re-enact every pair; of the truth's settings it reads how ICP runs, and the limits of the states."""
    settings = read_settings(ReenactmentSettings, job.section("reenactment"))
    truth = CauseSettings.from_dict(job.section("causes"), job.section("icp"))
    outputs = [job.reenactments, job.timings]
    with record_provenance(outputs, [job.causes, job.causes_timings], job.settings, seed=job.seed):
        causes = Causes.load(job.causes, (job.source, job.seed))
        seconds_S, icp_seconds_S = read_timings(job.causes_timings, causes.registrations)
        enacted, own_S, own_icp_S = reenact_all(causes, job.source, job.seed, settings, truth)
        enacted.save(job.reenactments)
        write_timings(job.timings, causes.registrations, seconds_S + own_S, icp_seconds_S + own_icp_S)
