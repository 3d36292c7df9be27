"""Registrations and predictions of all seeds -> real_world_failures."""

from gpca.reporting.figures.real_world_failures import draw_real_world_failures
from gpca.reporting.script import job

with job(snakemake):
    given = snakemake.input
    draw_real_world_failures(
        given.objects,
        given.registrations,
        given.poses,
        given.predictions,
        snakemake.params.title,
        snakemake.output.pdf,
        snakemake.output.png,
    )
