"""Registrations, embeddings and predictions of GP-CA, and learning curves -> fig4_pipeline."""

from gpca.reporting.figures.pipeline import draw_pipeline
from gpca.reporting.script import job

with job(snakemake):
    given, files, out = snakemake.params, snakemake.input, snakemake.output
    draw_pipeline(
        files.registrations,
        files.embeddings,
        files.predictions,
        files.curves,
        given.title,
        given.encoder,
        given.batch,
        out.pdf,
        out.png,
    )
