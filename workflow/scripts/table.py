"""Predictions, or metrics collected from them -> the table {table} as CSV, Markdown and LaTeX."""

from gpca.metrics import collect, read_metrics
from gpca.reporting.script import job
from gpca.reporting.tables import TABLES

with job(snakemake):
    given = snakemake.input
    metrics = read_metrics(given.metrics) if "metrics" in given.keys() else collect(given.predictions)  # noqa: SIM118
    table = TABLES[snakemake.wildcards.table](metrics, snakemake.params.sources, snakemake.params.explainers)
    table.write(snakemake.output.csv, snakemake.output.md, snakemake.output.tex)
