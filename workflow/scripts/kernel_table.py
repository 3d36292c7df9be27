"""Grids of kernels and schedules -> the table {table} as CSV, Markdown, LaTeX."""

from gpca.classifier.kernel_grid import read_grids
from gpca.reporting.script import job
from gpca.reporting.tables.kernel_grid import KERNEL_TABLES

with job(snakemake):
    grid = read_grids(snakemake.input.grids)
    table = KERNEL_TABLES[snakemake.wildcards.table](grid, snakemake.params.sources, snakemake.params.test)
    table.write(snakemake.output.csv, snakemake.output.md, snakemake.output.tex)
