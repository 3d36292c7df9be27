"""A run's collected numbers beside the printed ones and the paper's sentences -> verdicts on both, and on readings."""

from gpca.comparison.claims import counterparts_of, judge, read_claims
from gpca.comparison.markdown import comparison_markdown
from gpca.comparison.published import read_published, read_reasons
from gpca.comparison.readings import READINGS, judge_readings, with_readings
from gpca.comparison.values import cluster_draws, measured_on, read_results
from gpca.comparison.verdicts import Tolerance, compare
from gpca.experiments import reading_words
from gpca.io.csv_file import write_csv
from gpca.io.files import write_text
from gpca.jobs.job import workflow_script

with workflow_script(snakemake):
    given, params = snakemake.input, snakemake.params
    numbers, sentences = read_published(), read_claims()
    tolerances = {unit: Tolerance(**tolerance) for unit, tolerance in params.tolerances.items()}
    results = read_results([*given.collected, given.readings])
    counterparts = [*(number.counterpart for number in numbers), *counterparts_of(sentences)]
    clusters = cluster_draws(counterparts, given.predictions)
    comparison = compare(
        numbers,
        results,
        params.objects,
        tolerances,
        read_reasons(),
        measured_on(given.collected),
        clusters,
    )
    judged = judge_readings(numbers, comparison, results[READINGS], tolerances)
    comparison = with_readings(comparison, judged, reading_words)
    claims = judge(sentences, results, params.objects, given.predictions, clusters, params.floors)
    out = snakemake.output
    for frame, path in ((comparison, out.csv), (claims, out.claims), (judged, out.readings)):
        write_csv(path, frame, form=None)
    write_text(snakemake.output.md, comparison_markdown(comparison, tolerances))
