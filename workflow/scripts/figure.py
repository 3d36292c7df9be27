"""Files of a run -> a figure of the registry as PDF and PNG."""

from gpca.reporting.figures.style import save_figure
from gpca.reporting.registry import build
from gpca.reporting.script import data_of, job

with job(snakemake):
    entry = snakemake.params
    figure = build(entry.builder, entry.readers, data_of(snakemake.input), entry.arguments)
    save_figure(figure, snakemake.output.pdf, snakemake.output.png)
