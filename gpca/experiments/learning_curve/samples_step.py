"""Step ``learning_samples``: canonical clouds -> a chunk of further training samples, described and labeled."""

from __future__ import annotations

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import LABELS
from gpca.causes.drawing import draw_further
from gpca.causes.settings import CauseSettings
from gpca.experiments.learning_curve.samples import describe_cheaply
from gpca.experiments.learning_curve.settings import CurveSettings
from gpca.objects.canonical import ObjectClouds
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.settings import read_settings


def run(job: Job) -> None:
    """Draw the samples of one chunk; those of others do not depend on it."""
    chunk = int(job.chunk)
    wanted = read_settings(CurveSettings, job.section("learning_curve")).chunks()[chunk]
    icp = job.section("icp")
    settings = CauseSettings.from_dict(job.section("causes"), icp)
    with record_provenance([job.samples], [job.objects], job.settings, seed=job.seed):
        objects = ObjectClouds.load(job.objects, job.source)
        causes = draw_further(objects, job.source, job.seed, settings, chunk, wanted)
        lessons = describe_cheaply(causes, ICPSettings(**icp))
        lessons.subset(np.isin(lessons.label, LABELS)).save(job.samples, (job.source, job.seed))
