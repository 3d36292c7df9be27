"""What ``explain`` reads: sources and a target of the command line, or a CSV of pairs."""

import csv
import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from gpca.errors import InputError, refusing, require_known
from gpca.io.files import printable, require_file
from gpca.model.clouds import read_points, read_pose, read_target
from gpca.objects.canonical import CanonicalFrame
from gpca.objects.sizes import AS_OPTIONS, extent, require_sizes
from gpca.objects.surface import METERS_PER_UNIT, measured

COLUMNS = ("source", "target")  # of a CSV of pairs; optional ones are init or pose, unit and source_unit
FILES = (*COLUMNS, "init", "pose")
USED = (*FILES, "unit", "source_unit", "label", "group")
TargetReader = Callable[[Path], tuple[np.ndarray, CanonicalFrame | None]]
PAIRS_REMEDY = "give the columns source and target, and perhaps init or pose, unit and source_unit"


@dataclass(frozen=True)
class Inputs:
    """The files of one registration."""

    source: Path
    target: Path
    start: Path | None  # pose from which to register, or to judge
    unit: str  # of the target, the pose and the results
    source_unit: str | None  # None: the same
    judged: bool = False  # whether the pose is judged as it is

    def read(self, read_target: TargetReader) -> dict[str, Any]:
        """Return the arguments of the function that explains; InputError for a fault of a file."""
        T_init = read_pose(self.start) if self.start else None
        source = read_points(self.source)
        given: dict[str, Any] = {"source_points": source, "T_target_source_init": T_init, "unit": self.unit}
        if self.source_unit not in (None, self.unit):
            given["source_unit"] = self.source_unit
        target, frame = read_target(self.target)
        if frame is not None:
            extents = extent(measured(source, self.source)), extent(measured(target, self.target))
            units = self.source_unit or self.unit, self.unit
            require_sizes((self.source, self.target), extents, frame.diameter, units, AS_OPTIONS)
            given["frame"] = frame
        if self.judged:
            given |= {"T_target_source": T_init} if frame is None else {"register": False}
        return given | {"target_points": target}


def target_reader(scans: bool) -> TargetReader:
    """Return what reads the points and the frame of a target, but not twice in a row; scans have no frame."""
    return lru_cache(maxsize=1)((lambda path: (read_points(path), None)) if scans else read_target)


def from_words(options: Namespace) -> list[Inputs]:
    units = options.unit, options.source_unit
    start = options.pose or options.init
    return [Inputs(source, options.target, start, *units) for source in options.source]


def from_rows(options: Namespace, columns: Sequence[str] = COLUMNS) -> list[tuple[str, dict[str, str]]]:
    """Return the rows of a CSV of pairs, each with its place; InputError if it has none or lacks a column."""
    path = options.pairs
    require_file(path, "no such file", PAIRS_REMEDY)
    with refusing(path, "is not a readable CSV file ({})", PAIRS_REMEDY), path.open(encoding="utf-8-sig") as file:
        table = csv.DictReader(file, skipinitialspace=True)
        rows = [(f"{path}, line {table.line_num}", row) for row in table]
    names = list(table.fieldnames or ())
    if twice := [name for name in names if names.count(name) > 1]:
        raise InputError(path, f"column '{twice[0]}' occurs twice", PAIRS_REMEDY)
    if broken := [place for place, row in rows if "\0" in "".join(map(str, row.values()))]:
        raise InputError(broken[0], "has a zero byte", "write it anew")
    if unused := [name for name in names if name not in USED]:
        print(f"{path}: the column '{printable(unused[0])}' is not used", file=sys.stderr)
    if missing := [column for column in columns if column not in names]:
        raise InputError(path, f"column '{missing[0]}' is missing", PAIRS_REMEDY)
    if not rows:
        raise InputError(path, "has no rows", PAIRS_REMEDY)
    return rows


def inputs_in(row: dict[str, str], options: Namespace) -> Inputs:
    """Return the files of a row, whose paths are relative to the CSV, and whose units are first those of its own."""
    entries = {name: (row.get(name) or "").strip() for name in (*FILES, "unit", "source_unit")}
    if None in row:
        raise InputError("row", "has more entries than columns", "quote entries with commas")
    for name in COLUMNS:
        if not entries[name]:
            raise InputError(name, "is missing", "name a file")
    units = [entries[name] or getattr(options, name) for name in ("unit", "source_unit")]
    for unit in filter(None, units):
        require_known("unit", unit, METERS_PER_UNIT)
    folder = options.pairs.parent
    source, target = (folder / entries[name] for name in COLUMNS)
    if entries["pose"] and (entries["init"] or options.method):
        raise InputError("pose", "is judged as it is, without init or --method", "leave one of them out")
    start = entries["pose"] or entries["init"]
    return Inputs(source, target, folder / start if start else None, units[0], units[1], bool(entries["pose"]))
