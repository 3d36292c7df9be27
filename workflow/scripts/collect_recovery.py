"""What policies did about failures -> recovery.csv."""

from gpca.attribution.metrics import write_metrics
from gpca.recovery.metrics import collect_recovery
from gpca.reporting.script import job

with job(snakemake):
    given = snakemake.params
    write_metrics(collect_recovery(snakemake.input.recovery, given.treatments, given.budget), snakemake.output[0])
