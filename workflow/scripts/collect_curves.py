"""Learning curves -> active_learning.csv."""

from gpca.active_learning.metrics import collect_curves
from gpca.attribution.metrics import write_metrics
from gpca.reporting.script import job

with job(snakemake):
    write_metrics(collect_curves(snakemake.input.curves, snakemake.params.target), snakemake.output[0])
