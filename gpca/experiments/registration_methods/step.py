"""Step ``register_methods``: registrations -> their test pairs registered by every method, and how far each is off."""

from __future__ import annotations

from gpca.experiments.registration_methods.settings import PairSettings
from gpca.experiments.registration_methods.trial import try_methods
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Register by every method, seed by seed; the one that gives the others a start runs in any case."""
    settings = PairSettings(**job.section("method_pairs"))
    start = [settings.global_start] if settings.global_start in job.section("methods") else []
    methods = job.by_name("methods", dict.fromkeys([*job.methods, *start]))
    objects = ObjectClouds.load(job.objects, job.source)
    for i, (seed, path) in enumerate(job.per_seed("registrations")):
        of_seed = slice(i, None, len(job.seeds))
        outputs = job.rows[of_seed], job.timings[of_seed]
        inputs = [job.objects, path]
        with record_provenance([*outputs[0], *outputs[1]], inputs, job.settings, seed=seed):
            registrations = Registrations.load(path, (job.source, seed))
            trials = try_methods(registrations, objects, job.source, seed, methods, settings)
            for name, out, timings in zip(job.methods, *outputs, strict=True):
                rows = trials[name]
                write_csv(out, rows.drop(columns="seconds"))
                write_csv(timings, rows[["sample", "start", "seconds"]])
