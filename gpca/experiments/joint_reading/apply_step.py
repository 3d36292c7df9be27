"""Step ``apply_joint``: the joint reading and a source's test samples -> the values that it gives, once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gpca.errors import InputError
from gpca.evaluation.measures import tidy, write_metrics
from gpca.experiments.joint_reading.choices import PROTOCOL, SEVERITIES
from gpca.experiments.joint_reading.joint_values import values
from gpca.experiments.joint_reading.judgement import read_choices
from gpca.experiments.joint_reading.measured_samples import MeasureSettings, Subjects
from gpca.io.csv_file import finite_number
from gpca.objects.canonical import ObjectClouds
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.seeds import seed_of_file

TABLE = "joint_reading"  # `table` of its tidy rows


def read_choice(path: Path) -> dict[str, Any]:
    """Return the joint reading that the step ``choose_joint`` wrote.

    Raises:
        InputError: what :func:`gpca.experiments.joint_reading.judgement.read_choices` raises, or a share that is none.
    """
    joint = dict(read_choices(path).itertuples(index=False, name=None))
    return joint | {"new_share": finite_number(path, "new_share", joint["new_share"])}


def run(job: Job) -> None:
    """Measure the reading on the samples of its severities, seed by seed."""
    joint = read_choice(job.choice)
    severities = joint[SEVERITIES]
    files = job.files("sets") if severities == PROTOCOL else _of(severities, job.get("other_sets", []))
    settings, sizes = MeasureSettings.of_job(job), job.section("sizes")
    registrations = job.section("registrations") | job.section("severities").get(severities, {})
    with record_provenance([job.out], [job.choice, job.objects, *files], job.settings):
        objects, records = ObjectClouds.load(job.objects, job.source), []
        for path in files:
            axes = (job.source, seed_of_file(path))
            subjects = Subjects.load(objects, path, axes, registrations, sizes["samples"])
            measured = values(subjects, severities, {name: [value] for name, value in joint.items()}, settings)
            records += [(TABLE, job.source, *named, axes[1], value) for _, *named, value in measured]
        write_metrics(tidy(records, "joint reading"), job.out)


def _of(severities: str, files: list[Path]) -> list[Path]:
    """Return the files named ``…/{severities}/{source}/seed{seed}.npz``.

    Raises:
        InputError: there are none.
    """
    if not (own := [path for path in files if path.parts[-3] == severities]):
        raise InputError("joint reading", f"needs encoders of {severities} perturbations", "raise readings.encoders")
    return own
