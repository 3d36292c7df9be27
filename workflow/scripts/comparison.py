"""A run's collected numbers beside the printed ones -> comparison.csv and .md."""

from gpca.comparison.clusters import cluster_intervals
from gpca.comparison.published import read_published
from gpca.comparison.reasons import read_reasons
from gpca.comparison.values import measured_on, read_results
from gpca.comparison.verdicts import Tolerance, compare
from gpca.files import whole_file
from gpca.reporting.script import job
from gpca.reporting.tables.comparison import comparison_markdown

with job(snakemake):
    given, params = snakemake.input, snakemake.params
    numbers = read_published()
    tolerances = {unit: Tolerance(**tolerance) for unit, tolerance in params.tolerances.items()}
    comparison = compare(
        numbers,
        read_results(given.collected),
        params.objects,
        tolerances,
        read_reasons(numbers),
        measured_on(given.collected),
        cluster_intervals(numbers, given.predictions),
    )
    with whole_file(snakemake.output.csv) as partial:
        comparison.to_csv(partial, index=False, lineterminator="\n")
    with whole_file(snakemake.output.md) as partial:
        partial.write_text(comparison_markdown(comparison, tolerances), encoding="utf-8")
