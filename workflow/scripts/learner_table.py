"""Diagnostics of the learners -> the table {table} as CSV, Markdown, LaTeX."""

from gpca.attribution.metrics import read_metrics
from gpca.reporting.script import job
from gpca.reporting.tables.learners import LEARNER_TABLES

with job(snakemake):
    metrics = read_metrics(snakemake.input.metrics)
    table = LEARNER_TABLES[snakemake.wildcards.table](metrics, snakemake.params.sources, snakemake.params.learners)
    table.write(snakemake.output.csv, snakemake.output.md, snakemake.output.tex)
