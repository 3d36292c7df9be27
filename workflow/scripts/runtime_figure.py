"""Seconds of every stage -> runtime."""

from gpca.published import read_published
from gpca.reporting.runtime_figure import draw_runtime
from gpca.reporting.script import job
from gpca.runtime_file import read_runtime

with job(snakemake):
    runtime, numbers = read_runtime(snakemake.input.runtime), read_published(snakemake.input.published)
    draw_runtime(runtime, snakemake.params.title, numbers, snakemake.output.pdf, snakemake.output.png)
