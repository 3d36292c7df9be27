"""Seconds of every stage -> runtime."""

from gpca.reporting.runtime_figure import draw_runtime
from gpca.reporting.script import job
from gpca.runtime_file import read_runtime

with job(snakemake):
    draw_runtime(
        read_runtime(snakemake.input.runtime), snakemake.params.title, snakemake.output.pdf, snakemake.output.png
    )
