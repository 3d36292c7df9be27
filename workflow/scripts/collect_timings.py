"""Timing files -> timings.csv."""

from gpca.attribution.metrics import collect_timings, write_metrics
from gpca.reporting.script import job

with job(snakemake):
    write_metrics(collect_timings(snakemake.input.timings), snakemake.output[0])
