"""Step ``register_scans``: pairs of scans -> registered by every method, and how far each is off."""

from __future__ import annotations

from gpca.experiments.scans.settings import TrialSettings, part
from gpca.experiments.scans.trial import try_methods
from gpca.io.csv_file import write_csv
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.scans.scene import ScanPairs


def run(job: Job) -> None:
    """Register the pairs of one data set and seed."""
    settings = part(TrialSettings, job.section("scans"))
    methods = job.by_name("methods", job.methods)
    outputs = [*job.rows, *job.timings]
    with record_provenance(outputs, [job.scans], job.settings, seed=job.seed):
        pairs = ScanPairs.load(job.scans, (job.source, job.seed))
        trials = try_methods(pairs, job.source, job.seed, methods, settings)
        for rows, out, timings in zip(trials.values(), job.rows, job.timings, strict=True):
            write_csv(out, rows.drop(columns="seconds"))
            write_csv(timings, rows[["sample", "start", "seconds"]])
