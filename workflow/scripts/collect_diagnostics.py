"""Predictions of the learners, and the distances of the samples -> diagnostics.csv."""

from gpca.attribution.metrics import write_metrics
from gpca.reporting.script import job
from gpca.shift.metrics import collect_diagnostics

with job(snakemake):
    write_metrics(collect_diagnostics(snakemake.input.predictions, snakemake.input.sets), snakemake.output[0])
