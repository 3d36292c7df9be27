"""Commands ``explain``, why registrations are uncertain and what to do, and ``repair``, which puts them right."""

from __future__ import annotations

import json
import sys
from argparse import Action, ArgumentParser, Namespace
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gpca.commands.explain_inputs import COLUMNS, FILES, Inputs, from_rows, from_words, inputs_in, target_reader
from gpca.errors import InputError
from gpca.io.files import printable, require_apart
from gpca.jobs.arguments import length
from gpca.model.location import model_path, require_model
from gpca.objects.surface import METERS_PER_UNIT

if TYPE_CHECKING:
    from gpca.model.explainer import Explainer
    from gpca.model.explanation import ExplainedRegistration, Explanation

FAULTY_STATUS = 2  # exit code; 1 is a failed check
FORMATS = "PLY, PCD, OBJ, STL, OFF, VTK, glb, npy, npz, xyz, txt, asc, pts, csv, bin of KITTI or nuScenes"
FIGURE = "gpca.model.explanation_figure"  # by name: only this needs matplotlib
OBJECT_OPTIONS = ("model", "fast", "queue", "png", "repair")  # they need a model of objects
OF_ONE = ("html", "png", "save_pose", "out")  # outputs of one registration


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
    add("--source-unit", choices=METERS_PER_UNIT, help="unit of the sources, if another one")
    add("--model", type=Path, help="model file (default: GPCA_MODEL, one in ./results/, or the package's)")
    add("--method", help="registration method, such as gicp (default: the model's ICP)")
    add("--html", type=Path, metavar="FILE", help="write a page with all results and 3-D views")
    add("--scans", action="store_true", help="both clouds are partial scans of any size")
    add("--voxel", type=length, help="edge length of voxels for scans (default: from the point spacing)")
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="print one JSON object")
    form.add_argument("--json-lines", action="store_true", help="print one line of JSON per source or pair")


def run_explain(options: Namespace) -> int:
    """Read all files, then explain and print one source after the other; everything but results goes to stderr.

    Returns 2 if a source or row of several has a fault, else the largest status of an explanation or a repair.
    """
    _require_options(options)
    path = None if options.scans else model_path(options.model)
    if path is not None:
        require_model(path)
    rows = from_rows(options) if options.pairs else []
    row_files = [options.pairs.parent / name for _, row in rows for key in FILES if (name := row.get(key))]
    require_apart(options, [*OF_ONE, "queue"], [*filter(None, [path]), *row_files])
    if options.queue and options.queue.exists():
        from gpca.active_learning.labeling import require_queue

        require_queue(options.queue)
    inputs = [] if options.pairs else from_words(options)
    read_target = target_reader(options.scans)
    statuses, given = {0}, []

    @contextmanager
    def its_line(source: object, target: object, place: str = "") -> Iterator[None]:
        """With lines of JSON, a fault of one source is its line, and the others go on."""
        try:
            yield
        except InputError as fault:
            if not options.json_lines:
                raise
            statuses.add(FAULTY_STATUS)
            names = {"source": printable(source), "target": printable(target)}
            print(json.dumps(names | {"error": str(fault)}), flush=True)
            print(f"gpca {options.command}: {place}{fault}", file=sys.stderr)

    if inputs:
        read_target(options.target)
    for each in inputs:
        with its_line(each.source, each.target):
            given.append((each, each.read(read_target)))
    if not given and not rows:
        return FAULTY_STATUS
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

    explain: Callable[..., ExplainedRegistration]
    learned, names, extra = LEARNED, dict[str, str](), dict[str, str]()
    if path is None:
        from gpca.model.clouds import read_pose
        from gpca.model.scan_explainer import explain_scans, repair_scans

        explain = partial(
            repair_scans if options.repairs_alone else explain_scans,
            voxel=options.voxel,
            method=options.method,
            limit=None if options.tolerance is None else _length(options.tolerance, options.unit),
            T_target_source=None if options.pose is None else read_pose(options.pose),
        )
        if options.estimator or options.uncertainty:
            explain = partial(explain, estimator=options.estimator or "monte_carlo")
    else:
        from gpca.model.explainer import Explainer
        from gpca.model.file import Model
        from gpca.model.result import DEFAULT, Tolerance
        from gpca.uncertainty.settings import MONTE_CARLO, UncertaintySettings

        tolerance = Tolerance.parse(options.tolerance) if options.tolerance else DEFAULT
        model = Model.load(path)
        explainer, learned = Explainer(model), f"model {path}: {model.learning}"
        names["model"] = str(path)
        extra["trained_on"] = f"{model.title} (procedural stand-in)" if model.stand_in else model.title
        common = {"method": options.method, "register": options.pose is None, "tolerance": tolerance}
        explain = partial(explainer.repair, **common)
        if not options.repairs_alone:
            explain = partial(
                explainer.explain,
                uncertainty=UncertaintySettings() if options.uncertainty or options.estimator else None,
                estimator=options.estimator or MONTE_CARLO,
                fast=options.fast,
                repair=options.repair,
                **common,
            )

    def explain_one(each: Inputs, arguments: dict[str, Any]) -> None:
        try:
            explanation = explain(**arguments)
        except InputError as fault:
            raise InputError(each.source, str(fault)) from fault
        files = {"source": printable(each.source), "target": printable(each.target)}
        _write(options, explanation, files | names, extra)
        statuses.add(explanation.status)
        if isinstance(explanation, Explanation):
            _queue(options.queue, explainer, explanation, " to ".join(files.values()))

    for each, arguments in given:
        with its_line(each.source, each.target):
            explain_one(each, arguments)
    from gpca.process.progress import progress

    for place, row in progress(rows, "pairs", unit=" pairs") if rows else ():
        source, target = (options.pairs.parent / (row.get(name) or "") for name in COLUMNS)
        with its_line(source, target, f"{place}: "):
            each = inputs_in(row, options)
            explain_one(each, each.read(read_target))
    print(learned, file=sys.stderr)
    return FAULTY_STATUS if FAULTY_STATUS in statuses else max(statuses)


run_repair = run_explain


def _length(text: str, unit: str) -> float:
    """Return the tolerance of scans in the unit of the points; they have no diameter for a share or an angle."""
    from gpca.model.result import Tolerance

    tolerance = Tolerance.parse(text)
    if tolerance.unit not in METERS_PER_UNIT:
        raise InputError("--tolerance", f"'{text}' is no length, and scans have no diameter", "give one such as 0.2m")
    return tolerance.value * METERS_PER_UNIT[tolerance.unit] / METERS_PER_UNIT[unit]


def _require_options(options: Namespace) -> None:
    if options.pairs:
        if options.source or not options.json_lines:
            fault = "has sources and targets of its own" if options.source else "prints one line for each pair"
            raise InputError("--pairs", fault, "leave out the others" if options.source else "add --json-lines")
        options.source = []
        for name in ("init", "pose", *OF_ONE):
            if getattr(options, name):
                raise InputError(f"--{name.replace('_', '-')}", "is not for --pairs", "leave it out")
    if len(options.source) > 1 and not options.json_lines:
        raise InputError(options.command, f"{len(options.source)} sources need one line each", "add --json-lines")
    for name in OBJECT_OPTIONS if options.scans else ("voxel",):
        if (given := getattr(options, name)) is not None and given is not False:
            fault = "is not for scans" if options.scans else "is for scans alone"
            raise InputError(f"--{name}", fault, "leave it out" if options.scans else "add --scans")
    for name in OF_ONE:
        if getattr(options, name) and len(options.source) > 1:
            fault = f"--{name.replace('_', '-')}"
            raise InputError(fault, "is for one source", f"{options.command} one source after the other")
    for name in ("init", "method"):
        if options.pose and getattr(options, name):
            raise InputError("--pose", f"is judged as it is, without --{name}", "leave one of them out")
    if options.png and find_spec("matplotlib") is None:
        raise InputError("--png", "needs the package matplotlib, which is not installed", "pip install matplotlib")


def _write(
    options: Namespace, explanation: ExplainedRegistration, names: dict[str, str], extra: dict[str, str]
) -> None:
    as_json = options.json or options.json_lines
    # Text contains its warnings.
    warnings = [f"warning: {line}" for line in explanation.warnings] if as_json else []
    for line in (*explanation.notes, *warnings) if not options.pairs else ():
        print(line if len(options.source) == 1 else f"{names['source']}: {line}", file=sys.stderr)
    if as_json:
        print(json.dumps(explanation.as_dict() | names | extra), flush=options.json_lines)
    else:
        print(explanation.text(), end="")
    if options.save_pose:
        explanation.save_pose(options.save_pose)
        print(f"pose {options.save_pose}", file=sys.stderr)
    if options.out and explanation.status:
        print(f"no pose in {options.out}: none is settled", file=sys.stderr)
    elif options.out:
        explanation.save_pose(options.out)
        print(f"pose {options.out}", file=sys.stderr)
    if options.html:
        explanation.save_html(options.html, names)
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
