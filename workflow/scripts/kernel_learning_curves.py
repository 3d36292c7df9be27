"""Grids of kernels and schedules -> kernel_learning_curves."""

from gpca.classifier.kernel_grid import read_grids
from gpca.reporting.figures.kernel_grid import draw_kernel_curves
from gpca.reporting.script import job

with job(snakemake):
    grid = read_grids(snakemake.input.grids)
    draw_kernel_curves(grid, snakemake.params.sources, snakemake.output.pdf, snakemake.output.png)
