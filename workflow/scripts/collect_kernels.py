"""What every kernel and schedule gives -> kernels.csv."""

from gpca.attribution.metrics import write_metrics
from gpca.classifier.kernel_metrics import collect_grids
from gpca.reporting.script import job

with job(snakemake):
    write_metrics(collect_grids(snakemake.input.grids), snakemake.output[0])
