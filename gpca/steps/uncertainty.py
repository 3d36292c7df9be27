"""Step ``uncertainty``: registrations -> ``uncertainty/{source}/{design}/seed{seed}.npz``, by Monte-Carlo ICP."""

from __future__ import annotations

from gpca.alignment.icp import ICPSettings
from gpca.pairs.dataset import Registrations
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.uncertainty.designs import DESIGNS, design_rows, evaluate_design
from gpca.uncertainty.outcomes import write_seconds
from gpca.uncertainty.settings import UncertaintySettings


def run(job: Job) -> None:
    """Run the design's conditions for the registrations that it covers, seed by seed."""
    own, icp = job.settings_and_icp()
    samples = own.pop("samples", None)
    settings = UncertaintySettings(**own, icp=ICPSettings(**icp))
    for seed, registrations_path, out, table, timings in job.per_seed("registrations", "outcomes", "tables", "timings"):
        with record_provenance([out, table, timings], [registrations_path], job.settings, seed=seed):
            registrations = Registrations.load(registrations_path, (job.source, seed))
            chosen = registrations.subset(design_rows(registrations, job.design, samples))
            outcomes, *seconds = evaluate_design(job.design, chosen, job.source, seed, settings)
            outcomes.save(out, (job.source, seed))
            outcomes.write_table(table, DESIGNS[job.design].conditions)
            write_seconds(timings, outcomes, *seconds)
