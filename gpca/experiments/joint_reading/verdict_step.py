"""Step ``judge_joint``: the joint reading's values, the run's own and those of all readings, beside what is printed."""

from __future__ import annotations

import pandas as pd

from gpca.comparison.published import read_published
from gpca.comparison.readings import read_judged
from gpca.comparison.verdicts import Tolerance
from gpca.evaluation.measures import read_all_metrics, read_metrics, tidy, write_metrics
from gpca.experiments.joint_reading.judgement import VERDICT_COLUMNS, judge
from gpca.experiments.joint_reading.search import asked
from gpca.experiments.joint_reading.tally import EVALUATION
from gpca.io.csv_file import ANY, read_csv, write_csv
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Judge each number of the sources, and add the scores of all to those on development samples."""
    tolerances = {unit: Tolerance(**tolerance) for unit, tolerance in job.section("tolerances").items()}
    files = [*job.files("values"), job.comparison, job.readings, job.development]
    with record_provenance([job.verdicts, job.scores], files, job.settings):
        joint = read_all_metrics(job.files("values"))
        numbers = asked(read_published(), joint["source"].unique())
        own = read_csv(job.comparison, ("table", "row", "column", "reproduced", "at_least"), others=ANY)
        rows, records = judge(numbers, joint, own, read_judged(job.readings), tolerances, job.settings["deals"])
        write_csv(job.verdicts, pd.DataFrame(rows, columns=list(VERDICT_COLUMNS)), form=None)
        scores = [(table, EVALUATION, method, metric, "all", 0, float(v)) for table, method, metric, v in records]
        write_metrics(pd.concat([read_metrics(job.development), tidy(scores, "joint reading")]), job.scores)
