"""Commands ``explain``, why registrations are uncertain and what to do, and ``repair``, which puts them right."""

from __future__ import annotations

import csv
import json
import sys
from argparse import Action, ArgumentParser, Namespace
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.errors import InputError, refusing, require_known
from gpca.io.files import printable, require_apart, require_file
from gpca.jobs.arguments import length
from gpca.model.clouds import read_points, read_pose, read_target
from gpca.model.location import model_path, require_model
from gpca.objects.canonical import CanonicalFrame
from gpca.objects.sizes import AS_OPTIONS, extent, require_sizes
from gpca.objects.surface import METERS_PER_UNIT, measured

if TYPE_CHECKING:
    from gpca.model.explainer import Explainer
    from gpca.model.explanation import ExplainedRegistration, Explanation

COLUMNS = ("source", "target")  # of a CSV of pairs; optional ones are init or pose, unit and source_unit
FILES = (*COLUMNS, "init", "pose")
USED = (*FILES, "unit", "source_unit", "label", "group")
TargetReader = Callable[[Path], tuple[np.ndarray, CanonicalFrame | None]]
PAIRS_REMEDY = "give the columns source and target, and perhaps init or pose, unit and source_unit"
FAULTY_STATUS = 2  # exit code; 1 is a failed check
FORMATS = "PLY, PCD, OBJ, STL, OFF, VTK, glb, npy, npz, xyz, txt, asc, pts, csv, bin of KITTI or nuScenes"
FIGURE = "gpca.model.explanation_figure"  # by name: only this needs matplotlib
OBJECT_OPTIONS = ("model", "fast", "queue", "png", "repair")  # they need a model of objects
OF_ONE = ("html", "png", "save_pose", "out")  # outputs of one registration


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
        given: dict[str, Any] = {"source_points": source, "T_target_source_init": T_init}
        given |= {"unit": self.unit, "source_unit": self.source_unit}
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


class _InsteadOfClouds(Action):
    def __call__(self, parser: ArgumentParser, namespace: Namespace, values: Any, option: str | None = None) -> None:
        setattr(namespace, self.dest, values)
        for action in parser._actions:
            action.required = action.required and bool(action.option_strings)


def add_explain_arguments(parser: ArgumentParser) -> None:
    add_registration_arguments(parser, "judged as it is: nothing is registered")
    add = parser.add_argument
    add("--repair", action="store_true", help="put a wrong result right, as 'gpca repair' does")
    add("--save-pose", type=Path, metavar="FILE", help="write the pose that fits best, to start from with --init")
    add("--uncertainty", action="store_true", help="measure how much the pose varies over other ICP starts")
    add("--estimator", help="measure this by an estimator such as brossard (default: Monte-Carlo)")
    fast = "re-enact fewer points and poses, without a guarantee, in nine tenths of the time or less"
    add("--fast", action="store_true", help=fast)
    add("--png", type=Path, metavar="FILE", help="write a figure of the results")
    add("--queue", type=Path, metavar="FILE", help="add the registration, if queued, to a file for 'gpca label'")
    parser.set_defaults(out=None, repairs_alone=False)


def add_repair_arguments(parser: ArgumentParser) -> None:
    add_registration_arguments(parser, "put right as it is: nothing is registered first")
    out = "write the pose that is good or repaired; where none is, nothing is written"
    parser.add_argument("--out", type=Path, metavar="FILE", help=out)
    of_explain = dict.fromkeys(("save_pose", "estimator", "png", "queue")) | {"uncertainty": False, "fast": False}
    parser.set_defaults(**of_explain, repair=False, repairs_alone=True)


def add_registration_arguments(parser: ArgumentParser, given_pose: str) -> None:
    """Declare the clouds and what both commands ask of them; `given_pose` says what is done with a pose."""
    add = parser.add_argument
    add("source", type=Path, nargs="+", help=f"observed cloud or mesh ({FORMATS})")
    add("target", type=Path, help="reference to which each source is aligned")
    pairs = "CSV with the columns source, target and perhaps init or pose, unit, source_unit, in place of both"
    add("--pairs", type=Path, metavar="FILE", action=_InsteadOfClouds, help=pairs)
    add("--init", type=Path, help="file with the initial pose T_target_source: 4×4, 3×4 or TUM, text or npy")
    add("--pose", type=Path, help=f"such a file with a pose that is {given_pose}")
    add("--tolerance", help="how far the pose may be off: 5mm, 2deg or a share of the diameter (default 3%%)")
    add("--unit", choices=METERS_PER_UNIT, default="m", help="unit of files, pose and results (default m)")
    add("--source-unit", choices=METERS_PER_UNIT, help="unit of the sources, if it differs")
    add("--model", type=Path, help="model file (default: GPCA_MODEL, one in ./results/, or the package's)")
    add("--method", help="registration method, such as gicp (default: the model's ICP)")
    add("--html", type=Path, metavar="FILE", help="write a page with all results and 3-D views")
    add("--scans", action="store_true", help="both clouds are partial scans of any size")
    add("--voxel", type=length, help="edge length of voxels for scans (default: from the point spacing)")
    form = parser.add_mutually_exclusive_group()
    everything = "print all that was found as text, with the scores of GP-CA and durations"
    form.add_argument("--verbose", action="store_true", help=everything)
    form.add_argument("--json", action="store_true", help="print one JSON object")
    form.add_argument("--json-lines", action="store_true", help="print one line of JSON per source or pair")


def run_explain(options: Namespace) -> int:
    """Explain one source after the other; return 2 if one of several has a fault, else the largest status."""
    _require_options(options)
    path = None if options.scans else model_path(options.model)
    if path is not None:
        require_model(path)
    rows = from_rows(options) if options.pairs else []
    files = [options.pairs.parent / name for _, row in rows for key in FILES if (name := row.get(key))]
    require_apart(options, [*OF_ONE, "queue"], [*filter(None, [path]), *files])
    if options.queue and options.queue.exists():
        from gpca.active_learning.labeling import require_queue

        require_queue(options.queue)
    read_target = target_reader(options.scans)
    pairs: list[tuple[str, dict[str, Any], Callable[[], Inputs]]] = []
    for place, row in rows:
        named = {name: options.pairs.parent / (row[name] or "").strip() for name in COLUMNS}
        pairs.append((f"{place}: ", named, partial(inputs_in, row, options)))
    if options.source:
        read_target(options.target)
    for source in options.source:
        given = Inputs(source, options.target, options.pose or options.init, options.unit, options.source_unit)
        pairs.append(("", vars(given), partial(replace, given)))
    # Unknown methods and estimators are reported here, so that no message blames a file for them.
    if options.method is not None:
        from gpca.alignment.methods.registry import make_method

        make_method(options.method)
    if options.estimator is not None:
        from gpca.uncertainty.estimators.registry import make_estimator

        make_estimator(options.estimator, {})
    from gpca.process.compilation import say_when_compiling

    say_when_compiling()
    from gpca.model.explanation import LEARNED, Explanation

    learned, more = LEARNED, dict[str, str]()
    if path is None:
        explain = _of_scans(options)
    else:
        from gpca.model.explainer import Explainer
        from gpca.model.file import Model

        model = Model.load(path)
        explainer, learned = Explainer(model), f"model {path}: {model.learning}"
        explain = _of_objects(options, explainer)
        trained_on = f"{model.title} (procedural stand-in)" if model.stand_in else model.title
        more = {"model": str(path), "trained_on": trained_on}

    from gpca.process.progress import progress

    statuses = []
    for place, named, inputs in progress(pairs, "pairs", unit=" pairs") if rows else pairs:
        names = {name: printable(named[name]) for name in COLUMNS}
        try:
            arguments = inputs().read(read_target)
            try:
                explanation = explain(**arguments)
            except InputError as fault:
                raise InputError(names["source"], str(fault)) from fault
            _write(options, explanation, names, more)
            if isinstance(explanation, Explanation):
                _queue(options.queue, explainer, explanation, " to ".join(names.values()))
        except InputError as fault:  # with lines of JSON, it is a line of its own, and the others go on
            if not options.json_lines:
                raise
            statuses.append(FAULTY_STATUS)
            print(json.dumps(names | {"error": str(fault)}), flush=True)
            print(f"gpca {options.command}: {place}{fault}", file=sys.stderr)
        else:
            statuses.append(explanation.status)
    print(learned, file=sys.stderr)
    return FAULTY_STATUS if FAULTY_STATUS in statuses else max(statuses)


def _of_scans(options: Namespace) -> Callable[..., ExplainedRegistration]:
    from gpca.model.result import Tolerance
    from gpca.model.scan_explainer import explain_scans, repair_scans

    asked: dict[str, Any] = {}
    if options.estimator or options.uncertainty:
        asked["estimator"] = options.estimator or "monte_carlo"
    if options.tolerance is not None:  # scans have no diameter for a share or an angle
        tolerance = Tolerance.parse(options.tolerance)
        if tolerance.unit not in METERS_PER_UNIT:
            fault = f"'{options.tolerance}' is no length, and scans have no diameter"
            raise InputError("--tolerance", fault, "give one such as 0.2m")
        asked["limit"] = tolerance.value * METERS_PER_UNIT[tolerance.unit] / METERS_PER_UNIT[options.unit]
    return partial(
        repair_scans if options.repairs_alone else explain_scans,
        voxel=options.voxel,
        method=options.method,
        T_target_source=None if options.pose is None else read_pose(options.pose),
        **asked,
    )


def _of_objects(options: Namespace, explainer: Explainer) -> Callable[..., ExplainedRegistration]:
    from gpca.model.result import DEFAULT, Tolerance
    from gpca.uncertainty.settings import MONTE_CARLO, UncertaintySettings

    tolerance = Tolerance.parse(options.tolerance) if options.tolerance else DEFAULT
    common: dict[str, Any] = {"method": options.method, "register": options.pose is None, "tolerance": tolerance}
    if options.repairs_alone:
        return partial(explainer.repair, **common)
    return partial(
        explainer.explain,
        uncertainty=UncertaintySettings() if options.uncertainty or options.estimator else None,
        estimator=options.estimator or MONTE_CARLO,
        fast=options.fast,
        repair=options.repair,
        **common,
    )


run_repair = run_explain


def _require_options(options: Namespace) -> None:
    def refuse(names: Iterable[str], fault: str, remedy: str = "leave it out") -> None:
        for name in names:
            if getattr(options, name) not in (None, False):
                raise InputError(f"--{name.replace('_', '-')}", fault, remedy)

    if options.pairs:
        if options.source or not options.json_lines:
            fault = "has sources and targets of its own" if options.source else "prints one line for each pair"
            raise InputError("--pairs", fault, "leave out the others" if options.source else "add --json-lines")
        options.source = []
        refuse(("init", "pose", *OF_ONE), "is not for --pairs")
    if len(options.source) > 1:
        if not options.json_lines:
            raise InputError("--json-lines", f"is needed for {len(options.source)} sources", "add it")
        refuse(OF_ONE, "is for one source", f"{options.command} one source after the other")
    refuse(OBJECT_OPTIONS if options.scans else (), "is not for scans")
    refuse(() if options.scans else ("voxel",), "is for scans alone", "add --scans")
    for name in ("init", "method"):
        if options.pose and getattr(options, name):
            raise InputError("--pose", f"is judged as it is, without --{name}", "leave one of them out")
    if options.png and find_spec("matplotlib") is None:
        raise InputError("--png", "needs the package matplotlib, which is not installed", "pip install matplotlib")


def _write(options: Namespace, explanation: ExplainedRegistration, names: dict[str, str], more: dict[str, str]) -> None:
    as_json = options.json or options.json_lines
    # Text contains its warnings.
    warnings = [f"warning: {line}" for line in explanation.warnings] if as_json else []
    for line in (*explanation.notes, *warnings) if not options.pairs else ():
        print(line if len(options.source) == 1 else f"{names['source']}: {line}", file=sys.stderr)
    if as_json:
        print(json.dumps(explanation.as_dict() | names | more), flush=options.json_lines)
    else:
        print(explanation.text(options.verbose), end="")
    if options.out and explanation.status:
        print(f"{options.out} is not written: no pose is good or repaired", file=sys.stderr)
    for path in (options.save_pose, None if explanation.status else options.out):
        if path:
            explanation.save_pose(path)
            print(f"pose {path}", file=sys.stderr)
    if options.html:
        explanation.save_html(options.html, names | {"model": more.get("model", "")})
        print(f"page {options.html}", file=sys.stderr)
    if options.png:
        import_module(FIGURE).draw_explanation(explanation, options.png, f"{names['source']} to {names['target']}")
        print(f"figure {options.png}", file=sys.stderr)


def _queue(path: Path | None, explainer: Explainer, explanation: Explanation, name: str) -> None:
    """Add a registration to the queue if that is the action; without a file, print how to."""
    from gpca.causes.policy import QUEUE

    if explanation.action != QUEUE or explanation.scene is None:
        return
    if path is None:
        print("to label it: explain it with --queue queued.npz, then 'gpca label queued.npz'", file=sys.stderr)
        return
    from gpca.active_learning.labeling import add_to_queue

    aligned = explanation.scene.aligned
    count = add_to_queue(path, aligned, explanation.scene.target, explainer.embed(aligned), name)
    print(f"queued in {path}, which holds {count}", file=sys.stderr)
