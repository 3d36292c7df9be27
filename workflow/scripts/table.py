"""Predictions, or the metrics and timings collected from all of them -> the table {table} as CSV, Markdown, LaTeX."""

import pandas as pd

from gpca.attribution.metrics import collect, read_metrics
from gpca.reporting.script import job
from gpca.reporting.tables.explainers import TABLES

with job(snakemake):
    given = snakemake.input
    if "collected" in given.keys():  # noqa: SIM118
        metrics = pd.concat([read_metrics(path) for path in given.collected])
    else:
        metrics = collect(given.predictions)
    table = TABLES[snakemake.wildcards.table](metrics, snakemake.params.sources, snakemake.params.explainers)
    table.write(snakemake.output.csv, snakemake.output.md, snakemake.output.tex)
