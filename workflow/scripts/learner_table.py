"""Diagnostics of the learners -> the table {table} as CSV, Markdown, LaTeX."""

from gpca.metrics import read_metrics
from gpca.reporting.learner_tables import LEARNER_TABLES
from gpca.reporting.script import job

with job(snakemake):
    metrics = read_metrics(snakemake.input.metrics)
    table = LEARNER_TABLES[snakemake.wildcards.table](metrics, snakemake.params.sources, snakemake.params.learners)
    table.write(snakemake.output.csv, snakemake.output.md, snakemake.output.tex)
