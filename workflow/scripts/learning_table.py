"""Metrics of active learning -> the table {table} as CSV, Markdown, LaTeX."""

from gpca.attribution.metrics import read_metrics
from gpca.reporting.script import job
from gpca.reporting.tables.active_learning import LEARNING_TABLES

with job(snakemake):
    given = snakemake.params
    metrics = read_metrics(snakemake.input.metrics)
    table = LEARNING_TABLES[snakemake.wildcards.table](metrics, given.sources, given.strategies, given.conditions)
    table.write(snakemake.output.csv, snakemake.output.md, snakemake.output.tex)
