"""Seconds of every stage -> table7_runtime as CSV, Markdown, LaTeX."""

from gpca.reporting.runtime_table import table7_runtime
from gpca.reporting.script import job
from gpca.runtime_file import read_runtime

with job(snakemake):
    table = table7_runtime(read_runtime(snakemake.input.runtime), snakemake.params.title)
    table.write(snakemake.output.csv, snakemake.output.md, snakemake.output.tex)
