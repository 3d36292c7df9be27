"""Metrics and seconds of recovery -> table8_recovery as CSV, Markdown, LaTeX."""

from gpca.attribution.metrics import read_metrics
from gpca.recovery.metrics import mean_seconds
from gpca.reporting.script import job
from gpca.reporting.tables.recovery import table8_recovery

with job(snakemake):
    metrics, seconds = read_metrics(snakemake.input.metrics), mean_seconds(snakemake.input.timings)
    table = table8_recovery(metrics, seconds, snakemake.params.policies, snakemake.params.budget)
    table.write(snakemake.output.csv, snakemake.output.md, snakemake.output.tex)
