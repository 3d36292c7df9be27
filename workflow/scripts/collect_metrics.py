"""Prediction files, and what is causal among their samples -> metrics.csv."""

from gpca.attribution.metrics import collect, write_metrics
from gpca.reporting.script import job

with job(snakemake):
    write_metrics(collect(snakemake.input.predictions, snakemake.input.get("causal", ())), snakemake.output[0])
