"""Step ``readings``: files of a run -> the printed numbers' counterparts under every reading of one group."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd

from gpca.errors import InputError
from gpca.evaluation.measures import TIDY_COLUMNS, write_metrics
from gpca.experiments.specification_curve.registry import GROUPS
from gpca.experiments.specification_curve.run_files import RunFiles, by_backbone, by_method, by_source_and_seed
from gpca.experiments.specification_curve.settings import ReadingSizes, name_of, readings_of
from gpca.process.job import Job
from gpca.process.provenance import record_provenance

KINDS: dict[str, Callable[[list[Path]], dict]] = {
    "registrations": by_source_and_seed,
    "sets": by_source_and_seed,
    "predictions": by_method,
    "embeddings": by_backbone,
    "retrained": by_method,
}


def run(job: Job) -> None:
    """Run every reading of the group."""
    group = GROUPS[job.group]
    choices = job.section("choices")
    files: dict[str, Any] = {kind: KINDS[kind](getattr(job, kind)) for kind in group.reads}
    inputs = [path for of_kind in files.values() for path in of_kind.values()]
    with record_provenance([job.out], inputs, job.settings):
        run_files = RunFiles(**files, settings=job.settings)
        readings = readings_of({name: choices[name] for name in group.choices})
        rows = group.function()(run_files, readings, ReadingSizes(**job.section("sizes")))
        records = [(name_of(job.group, reading), *value) for reading, *value in rows]
        if not records:
            remedy = f"raise registrations.train, or real_world.train, or set readings.groups.{job.group} to false"
            raise InputError(f"readings of {job.group}", "need more training samples than the run has", remedy)
        write_metrics(pd.DataFrame(records, columns=list(TIDY_COLUMNS)), job.out)
