"""Registrations, embeddings and predictions of GP-CA -> fig2_overview."""

from gpca.reporting.figures.overview import draw_overview
from gpca.reporting.script import job

with job(snakemake):
    given, files, out = snakemake.params, snakemake.input, snakemake.output
    draw_overview(
        files.registrations,
        files.embeddings,
        files.predictions,
        given.title,
        given.encoder,
        given.treatments,
        out.pdf,
        out.png,
    )
