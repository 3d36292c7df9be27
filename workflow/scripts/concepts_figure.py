"""Objects and registrations of one source -> fig3_concepts."""

from gpca.reporting.figures.concepts import draw_concepts_figure
from gpca.reporting.script import job

with job(snakemake):
    draw_concepts_figure(
        snakemake.input.objects,
        snakemake.input.registrations,
        snakemake.params.title,
        snakemake.output.pdf,
        snakemake.output.png,
        snakemake.params.get("object_name"),
    )
