"""Seconds of every stage -> runtime."""

from gpca.comparison.published import read_published
from gpca.model.runtime_file import read_runtime
from gpca.reporting.figures.runtime import draw_runtime
from gpca.reporting.script import job

with job(snakemake):
    runtime, numbers = read_runtime(snakemake.input.runtime), read_published(snakemake.input.published)
    draw_runtime(runtime, snakemake.params.title, numbers, snakemake.output.pdf, snakemake.output.png)
