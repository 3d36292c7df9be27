"""Step ``learning_curve``: causes, descriptors and further samples -> how well is learned from how many."""

from __future__ import annotations

from typing import Any

import numpy as np

from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.descriptors import Descriptors
from gpca.experiments.learning_curve.curve import learning_curve
from gpca.experiments.learning_curve.samples import Lessons
from gpca.experiments.learning_curve.settings import GROUPS, CurveSettings
from gpca.io.csv_file import write_csv
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.settings import read_settings


def run(job: Job) -> None:
    """Pool the training samples, and learn from more and more of them."""
    settings = read_settings(CurveSettings, job.section("learning_curve"))
    axes = (job.source, job.seed)
    with record_provenance([job.out], [job.causes, job.descriptors, *job.samples], job.settings, seed=job.seed):
        causes = Causes.load(job.causes, axes)
        described = Descriptors.load(job.descriptors, causes.registrations)
        groups: dict[str, Any] = {name: described.groups[name] for name in GROUPS}
        own = Lessons(**groups, label=labels_of(causes.truth))
        train, test = causes.rows("train"), causes.rows("test")
        labeled = train[np.isin(own.label[train], LABELS)]
        pool = Lessons.joined([own.subset(labeled), *(Lessons.load(path, axes) for path in job.samples)])
        write_csv(job.out, learning_curve(pool, own.subset(test), causes.subset(test), settings, *axes))
