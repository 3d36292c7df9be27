"""Step ``choose_joint``: values on development samples -> the joint reading with the largest share of close numbers."""

from __future__ import annotations

import pandas as pd

from gpca.comparison.published import read_published
from gpca.comparison.verdicts import Tolerance
from gpca.evaluation.measures import read_all_metrics, tidy, write_metrics
from gpca.experiments.joint_reading.choices import CHOICES, text_of
from gpca.experiments.joint_reading.search import asked, search
from gpca.experiments.joint_reading.tally import DEVELOPMENT, EVALUATED, counted
from gpca.io.csv_file import write_csv
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Search, and write the reading, the best ones, and what the largest share is worth."""
    tolerances = {unit: Tolerance(**tolerance) for unit, tolerance in job.section("tolerances").items()}
    published = read_published()
    numbers, printed = asked(published, [job.settings["stands_for"]]), asked(published)
    files, outputs = job.files("measured"), [job.choice, job.best, job.scores]
    with record_provenance(outputs, files, job.settings):
        measured = read_all_metrics(files)
        found = search(numbers, printed, measured, job.section("choices"), tolerances, job.settings["deals"])
        write_csv(
            job.choice, pd.DataFrame([(c, text_of(found.joint[c])) for c in CHOICES], columns=["choice", "value"])
        )
        best = [{"share": share, **{c: text_of(joint[c]) for c in CHOICES}} for joint, share in found.best]
        write_csv(job.best, pd.DataFrame(best), form=None)
        records = counted(numbers, found.close, found.share, found.by_chance)
        records += [("all", EVALUATED, name, value) for name, value in found.counts().items()]
        rows = [(table, DEVELOPMENT, method, metric, "all", 0, float(v)) for table, method, metric, v in records]
        write_metrics(tidy(rows, "joint reading"), job.scores)
