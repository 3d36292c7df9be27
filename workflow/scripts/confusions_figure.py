"""Metrics of every explainer -> fig_attribution_confusions."""

from gpca.reporting.figures.confusions import draw_confusions_figure
from gpca.reporting.script import job

with job(snakemake):
    draw_confusions_figure(
        snakemake.input.metrics,
        snakemake.params.sources,
        snakemake.params.explainers,
        snakemake.output.pdf,
        snakemake.output.png,
    )
