"""Metrics of every backbone -> confusion_real_world."""

from gpca.reporting.figures.real_world_confusions import draw_real_world_confusions
from gpca.reporting.script import job

with job(snakemake):
    draw_real_world_confusions(
        snakemake.input.metrics,
        snakemake.params.title,
        snakemake.params.methods,
        snakemake.output.pdf,
        snakemake.output.png,
    )
