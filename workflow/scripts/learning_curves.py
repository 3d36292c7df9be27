"""Learning curves of every source and strategy -> active_learning_curves."""

from gpca.reporting.figures.active_learning import draw_learning_curves
from gpca.reporting.script import job

with job(snakemake):
    given = snakemake.params
    draw_learning_curves(
        snakemake.input.curves,
        given.sources,
        given.strategies,
        given.target,
        snakemake.output.pdf,
        snakemake.output.png,
    )
