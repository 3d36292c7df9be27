"""What came of recovery -> one of its figures."""

from gpca.attribution.metrics import read_metrics
from gpca.reporting.figures.policy import draw_mitigation
from gpca.reporting.figures.recovery_example import draw_recovery_example
from gpca.reporting.figures.recovery_rates import draw_recovery_rates
from gpca.reporting.script import job

with job(snakemake):
    files = (snakemake.output.pdf, snakemake.output.png)
    if snakemake.wildcards.figure == "recovery_rates":
        given = snakemake.params
        draw_recovery_rates(read_metrics(snakemake.input.data), given.policies, given.budget, *files)
    elif snakemake.wildcards.figure == "fig6_mitigation":
        draw_mitigation(snakemake.input.data, *files)
    else:
        draw_recovery_example(snakemake.input.data, *files)
