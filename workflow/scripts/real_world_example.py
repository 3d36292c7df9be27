"""Frames, registrations and predictions of one seed -> fig5_real_world_example."""

from gpca.reporting.figures.real_world_example import draw_real_world_example
from gpca.reporting.script import job

with job(snakemake):
    given = snakemake.input
    draw_real_world_example(
        given.instances,
        given.objects,
        given.registrations,
        given.poses,
        given.predictions,
        snakemake.params.title,
        snakemake.output.pdf,
        snakemake.output.png,
    )
