"""Step ``estimate``: registrations with measured causes -> every estimator's covariance of their poses."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gpca.alignment.methods.registry import require_local
from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings
from gpca.experiments.estimators.estimation import reference_samples, try_estimators
from gpca.experiments.estimators.settings import EstimatorPairSettings
from gpca.experiments.estimators.situations import Situations
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.judge import Judges
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Ask every estimator, seed by seed; those that learn also after examples of another source, if one is given."""
    settings = EstimatorPairSettings(**job.section("estimator_pairs"), failed=job.section("success")["error"])
    for name in settings.methods:
        require_local(name)
    drawn_by = CauseSettings.from_dict(job.section("causes"), job.section("icp"))
    estimators = job.by_name("estimators", job.estimators)
    named = {job.source: job.objects} | ({job.other: job.files("other_objects")[0]} if job.get("other") else {})
    objects = {source: ObjectClouds.load(path, source) for source, path in named.items()}
    judges = {source: Judges(of, f"objects of {source}") for source, of in objects.items()}

    def situations(source: str, seed: int, path) -> Situations:
        causes = Causes.load(path, (source, seed))
        return Situations(source, seed, causes, drawn_by, objects[source], judges[source])

    others = job.files("other_causes") if job.get("other") else []
    samples: Sequence[Path | None] = job.files("samples") if job.get("samples") else [None] * len(job.seeds)
    for i, (seed, path) in enumerate(job.per_seed("causes")):
        of_seed = slice(i, None, len(job.seeds))
        out, timings = job.rows[of_seed], job.timings[of_seed]
        inputs = [*named.values(), path, *others[i : i + 1]]
        with record_provenance([*out, *timings, *filter(None, samples[i : i + 1])], inputs, job.settings, seed=seed):
            other = situations(job.other, seed, others[i]) if others else None
            rows, cases = try_estimators(situations(job.source, seed, path), other, estimators, settings)
            if (sampled := samples[i]) is not None:
                reference_samples(cases).save(sampled, (job.source, seed))
            for name, own_out, own_timings in zip(job.get("estimates", list(rows)), out, timings, strict=True):
                of_estimator = rows[name]
                write_csv(own_out, of_estimator.drop(columns="seconds"))
                write_csv(own_timings, of_estimator[["sample", "method", "seconds"]])
