"""Step ``readings``: files of a run -> the printed numbers' counterparts under every reading of one group."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_type_hints

import pandas as pd
import torch

from gpca.attribution.metrics import TIDY_COLUMNS, write_metrics
from gpca.errors import InputError
from gpca.experiments.specification_curve.registry import GROUPS
from gpca.experiments.specification_curve.run_files import (
    SECTIONS,
    RunFiles,
    by_backbone,
    by_method,
    by_source_and_seed,
)
from gpca.experiments.specification_curve.settings import ReadingSizes, name_of, readings_of
from gpca.process.provenance import record_provenance
from gpca.settings import check_settings, checked_sections

KINDS: dict[str, Callable[[list[Path]], dict]] = {
    "registrations": by_source_and_seed,
    "sets": by_source_and_seed,
    "poses": by_source_and_seed,
    "predictions": by_method,
    "embeddings": by_backbone,
}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files; ``--settings`` holds the group's `choices`, the `sizes`, and sections of the config by name."""
    parser.add_argument("--group", required=True, choices=GROUPS)
    for kind in KINDS:
        parser.add_argument(
            f"--{kind}", nargs="*", default=[], type=Path, help="files named by source, method and seed"
        )
    parser.add_argument("--out", required=True, type=Path, help="tidy CSV")


def run(options: Namespace) -> None:
    """Run every reading of the group."""
    torch.set_num_threads(options.threads)
    group = GROUPS[options.group]
    settings = dict(options.settings)
    choices, sizes = settings.pop("choices", {}), settings.pop("sizes", {})
    check_settings(choices, "readings", "groups", options.group)
    check_settings(sizes, "readings")
    sections = checked_sections(settings, SECTIONS)
    names = list(get_type_hints(group.choices))
    if missing := [name for name in names if name not in choices]:
        raise InputError(f"choices of {options.group}", f"lack '{missing[0]}'", "give its values")
    for kind in KINDS:
        if bool(getattr(options, kind)) != (kind in group.reads):
            wanted = "give at least one file" if kind in group.reads else "leave it out"
            read = ", ".join(group.reads)
            raise InputError(f"--{kind}", f"readings of {options.group} read {read}", wanted)
    files: dict[str, Any] = {kind: by_name(getattr(options, kind)) for kind, by_name in KINDS.items()}
    inputs = [path for of_kind in files.values() for path in of_kind.values()]
    with record_provenance([options.out], inputs, options.settings):
        run_files = RunFiles(**files, sections=sections)
        readings = readings_of({name: choices[name] for name in names})
        rows = group.function()(run_files, readings, ReadingSizes(**sizes))
        records = [(name_of(options.group, reading), *value) for reading, *value in rows]
        if not records:
            remedy = f"raise registrations.train, or real_world.train, or set readings.groups.{options.group} to false"
            raise InputError(f"readings of {options.group}", "need more training samples than the run has", remedy)
        write_metrics(pd.DataFrame(records, columns=list(TIDY_COLUMNS)), options.out)
