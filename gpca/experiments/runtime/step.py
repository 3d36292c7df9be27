"""Step ``runtime``: model, registrations and embeddings -> ``runtime.csv``, the seconds of every stage."""

from __future__ import annotations

from dataclasses import replace

from gpca.active_learning.rounds import make_task
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.experiments.runtime.runtime import measure
from gpca.io.csv_file import write_csv
from gpca.model.file import Model
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Measure every component, repeat by repeat."""
    axes = (job.source, job.seed)
    inputs = [job.model, job.registrations, job.embeddings]
    with record_provenance([job.out], inputs, job.settings, seed=job.seed):
        model = Model.load(job.model)
        registrations = Registrations.load(job.registrations, axes)
        embedded = replace(registrations, attached=read_embedding(job.embeddings, registrations))
        settings = ActiveLearningSettings.from_dict(job.section("active_learning"))
        task = make_task(embedded, "overlap", settings, *axes)
        repeats = job.section("runtime").get("repeats", 100)
        write_csv(job.out, measure(model, registrations, task, settings, repeats, job.threads, *axes))
