"""Step ``learners``: embeddings of all sets -> predictions of every learner for their test samples."""

from __future__ import annotations

from functools import partial

from gpca.errors import InputError
from gpca.experiments.out_of_distribution.learners import predict_sets
from gpca.experiments.out_of_distribution.sets import ShiftedSets
from gpca.explainers.registry import explainer_entry
from gpca.io.csv_file import write_csv
from gpca.process.job import Job
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Fit every learner and let it explain, seed by seed."""
    for learner in job.learners:
        if explainer_entry(learner).reads != "embeddings":
            raise InputError(f"learner '{learner}'", "does not read embeddings", "choose another")

    for i, (seed, path) in enumerate(job.per_seed("sets")):
        sets = ShiftedSets.load(path, (job.source, seed))
        outputs = job.out[i :: len(job.seeds)]
        title = f"learners on {job.source}, seed {seed}"
        for learner, out in progress(list(zip(job.learners, outputs, strict=True)), title):
            settings = job.section(learner)
            with record_provenance([out], [path], settings, seed=seed):
                make = partial(explainer_entry(learner).make, job.source, seed, **settings)
                write_csv(out, predict_sets(make, sets))
