"""Seconds of every stage -> table7_runtime as CSV, Markdown, LaTeX."""

from gpca.comparison.published import read_published
from gpca.model.runtime_file import read_runtime
from gpca.reporting.script import job
from gpca.reporting.tables.runtime import table7_runtime

with job(snakemake):
    runtime, numbers = read_runtime(snakemake.input.runtime), read_published(snakemake.input.published)
    table = table7_runtime(runtime, snakemake.params.title, numbers)
    table.write(snakemake.output.csv, snakemake.output.md, snakemake.output.tex)
