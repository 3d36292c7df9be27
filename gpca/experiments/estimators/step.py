"""Step ``estimate``: registrations with measured causes -> every estimator's covariance of their poses."""

from __future__ import annotations

from gpca.alignment.methods.registry import require_local
from gpca.causes.dataset import Causes
from gpca.experiments.estimators.estimation import reference_samples, try_estimators
from gpca.experiments.estimators.settings import EstimatorPairSettings
from gpca.experiments.judge import Judges
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import ObjectClouds
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Ask every estimator, seed by seed."""

    settings = EstimatorPairSettings(**job.section("estimator_pairs"), failed=job.section("success")["error"])
    for name in settings.methods:
        require_local(name)
    estimators = job.by_name("estimators", job.estimators)
    judges = Judges(ObjectClouds.load(job.objects, job.source), f"objects of {job.source}")
    for i, (seed, path, samples) in enumerate(job.per_seed("causes", "samples")):
        axes = (job.source, seed)
        of_seed = slice(i, None, len(job.seeds))
        out, timings = job.rows[of_seed], job.timings[of_seed]
        inputs = [job.objects, path]
        with record_provenance([*out, *timings, samples], inputs, job.settings, seed=seed):
            rows, cases = try_estimators(Causes.load(path, axes), judges, *axes, estimators, settings)
            reference_samples(cases).save(samples, axes)
            for of_estimator, own_out, own_timings in zip(rows.values(), out, timings, strict=True):
                write_csv(own_out, of_estimator.drop(columns="seconds"))
                write_csv(own_timings, of_estimator[["sample", "method", "seconds"]])
