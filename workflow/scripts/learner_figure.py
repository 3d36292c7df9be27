"""Predictions of the learners, and distances where the figure shows them -> the figure {figure}."""

from gpca.reporting.figures.learners import LEARNER_FIGURES
from gpca.reporting.script import job
from gpca.shift.metrics import read_learner_predictions

with job(snakemake):
    learned = read_learner_predictions(snakemake.input.predictions, snakemake.input.get("sets", []))
    draw = LEARNER_FIGURES[snakemake.wildcards.figure]
    given = snakemake.params
    draw(learned, given.sources, given.learners, snakemake.output.pdf, snakemake.output.png)
