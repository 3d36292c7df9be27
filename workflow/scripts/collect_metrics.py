"""Prediction files -> metrics.csv."""

from gpca.metrics import collect, write_metrics
from gpca.reporting.script import job

with job(snakemake):
    write_metrics(collect(snakemake.input.predictions), snakemake.output[0])
