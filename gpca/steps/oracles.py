"""The step of oracles: objects and causes of a seed -> diagnoses by re-enactments that know parts of the truth."""

from __future__ import annotations

from gpca.attribution.predictions import write_predictions
from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings
from gpca.objects.canonical import ObjectClouds
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.reenactment.oracle import ask_oracles
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import read_settings


def run(job: Job) -> None:
    """Diagnose the test samples; the predictions of each oracle go to the folder of its name."""
    settings = read_settings(ReenactmentSettings, job.section("reenactment"))
    truth = CauseSettings.from_dict(job.section("causes"), job.section("icp"))
    own = {path.parts[-2]: path for path in job.predictions}
    with record_provenance(job.predictions, [job.objects, job.causes], job.settings, seed=job.seed):
        objects = ObjectClouds.load(job.objects, job.source)
        causes = Causes.load(job.causes, (job.source, job.seed))
        tested = causes.subset(causes.rows("test"))
        for name, attribution in ask_oracles(objects, tested, job.source, job.seed, settings, truth).items():
            write_predictions(own[name], tested.registrations, attribution)
