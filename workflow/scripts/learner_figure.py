"""Predictions of the learners, and distances where the figure shows them -> the figure {figure}."""

from gpca.learner_metrics import read_learned
from gpca.reporting.learner_figures import LEARNER_FIGURES
from gpca.reporting.script import job

with job(snakemake):
    learned = read_learned(snakemake.input.predictions, snakemake.input.get("sets", []))
    draw = LEARNER_FIGURES[snakemake.wildcards.figure]
    given = snakemake.params
    draw(learned, given.sources, given.learners, snakemake.output.pdf, snakemake.output.png)
