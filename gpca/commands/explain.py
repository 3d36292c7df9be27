"""Step ``explain``: registrations of a user's own -> why they are uncertain and what to do, on stdout."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser, Namespace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.errors import InputError
from gpca.io.files import require_outputs
from gpca.model.location import model_path, require_model
from gpca.model.point_file import read_points, read_pose, read_scan, require_format
from gpca.objects.mesh_folder import METERS_PER_UNIT
from gpca.process.arguments import length
from gpca.uncertainty.settings import MONTE_CARLO, UncertaintySettings

if TYPE_CHECKING:
    from gpca.model.explainer import Explainer
    from gpca.model.explanation import Explanation
    from gpca.model.scan_explanation import ScanExplanation

UNKNOWN_STATUS = 3  # of the process; 1 is a failed check of another step, 2 a fault of the user's
FORMATS = "PLY, PCD, OBJ, STL, OFF, npy, npz, xyz, csv, KITTI's bin, LAS, E57"
FIGURE = "gpca.reporting.figures.explanation"  # by its name, since it needs matplotlib, which nothing else here does
NOT_OF_SCANS = ("model", "fast", "uncertainty", "estimator", "queue", "png")  # what they say was learned from objects


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and options."""
    parser.add_argument("source", type=Path, nargs="+", help=f"observed cloud or mesh ({FORMATS})")
    parser.add_argument("target", type=Path, help="reference to which each source is aligned")
    parser.add_argument("--init", type=Path, help="text file with the 4×4 matrix T_target_source, the initial pose")
    parser.add_argument(
        "--unit", choices=METERS_PER_UNIT, default="m", help="unit of the files and the pose (default m)"
    )
    parser.add_argument(
        "--model", type=Path, help="model file (default: GPCA_MODEL, one in ./results/, or the package's)"
    )
    parser.add_argument("--method", help="registration method, such as gicp (default: the model's ICP)")
    parser.add_argument(
        "--uncertainty", action="store_true", help="measure how much the pose varies over other ICP starts"
    )
    parser.add_argument("--estimator", help="measure this by an estimator such as brossard (default: Monte-Carlo)")
    parser.add_argument("--fast", action="store_true", help="re-enact fewer points and poses, without a guarantee")
    parser.add_argument("--html", type=Path, metavar="FILE", help="write a page with all results and 3-D views")
    parser.add_argument("--png", type=Path, metavar="FILE", help="write a figure of the results")
    parser.add_argument(
        "--queue", type=Path, metavar="FILE", help="add the registration, if queued, to a file for 'gpca label'"
    )
    parser.add_argument("--scans", action="store_true", help="both clouds are partial scans of any size")
    parser.add_argument(
        "--voxel", type=length, help="edge length of voxels for scans (default: from the point spacing)"
    )
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="print one JSON object")
    form.add_argument("--json-lines", action="store_true", help="print one line of JSON per source")


def run(options: Namespace) -> int:
    """Read all files, then explain and print one source after the other; everything but results goes to stderr.

    The clouds are read before any library is loaded that they do not need: most mistakes are found there.

    Returns:
        `UNKNOWN_STATUS` where one of the explanations means nothing, otherwise 0.
    """
    _require_fitting(options)
    if options.scans:
        return _explain_scans(options)
    path = model_path(options.model)
    require_model(path)
    _require_formats(options)
    T_init = read_pose(options.init) if options.init else None
    sources = [read_points(source, options.unit)[0] for source in options.source]
    target, frame = read_points(options.target, options.unit)
    _require_known(options.method, options.estimator)
    import torch

    from gpca.model.explainer import Explainer
    from gpca.model.file import Model
    from gpca.process.compilation import say_when_compiling

    torch.set_num_threads(options.threads)
    say_when_compiling()
    model = Model.load(path)
    requested = {
        "uncertainty": UncertaintySettings() if options.uncertainty or options.estimator else None,
        "estimator": options.estimator or MONTE_CARLO,
        "method": options.method,
        "fast": options.fast,
    }
    explainer = Explainer(model)
    trained_on = f"{model.title} (procedural stand-in)" if model.stand_in else model.title
    status = 0
    for name, source in zip(options.source, sources, strict=True):
        try:
            explanation = explainer.explain(source, target, T_init, options.unit, frame, **requested)
        except InputError as fault:
            raise InputError(name, str(fault)) from fault
        status = UNKNOWN_STATUS if explanation.unknown else status
        names = {"source": str(name), "target": str(options.target), "model": str(path)}
        _print(options, explanation, names | {"trained_on": trained_on})
        _write(options, explanation, names)
        _queue(options.queue, explainer, explanation, f"{name} to {options.target}")
    print(f"model {path}: {model.learning}", file=sys.stderr)
    return status


def _require_fitting(options: Namespace) -> None:
    """Refuse options that do not go together, and files that cannot be written."""
    if options.settings:
        raise InputError("--settings", "is not used by explain", "make another model to change its settings")
    if len(options.source) > 1 and not options.json_lines:
        raise InputError("explain", f"{len(options.source)} sources need one line each", "add --json-lines")
    for name in NOT_OF_SCANS if options.scans else ("voxel",):
        if (given := getattr(options, name)) is not None and given is not False:
            fault = "is not for scans" if options.scans else "is for scans alone"
            raise InputError(f"--{name}", fault, "leave it out" if options.scans else "add --scans")
    for name in ("html", "png"):
        if getattr(options, name) and len(options.source) > 1:
            raise InputError(f"--{name}", "shows one source", "explain one source after the other")
    if options.png and find_spec("matplotlib") is None:
        raise InputError("--png", "needs the package matplotlib, which is not installed", "pip install matplotlib")
    read = [*options.source, options.target, options.init, options.model]
    outputs = [path for path in (options.html, options.png, options.queue) if path]
    require_outputs(outputs, [path for path in read if path])


def _require_formats(options: Namespace) -> None:
    """Refuse files that are missing or of another format, before the first of them is read."""
    for cloud in (*options.source, options.target):
        require_format(cloud)


def _require_known(method: str | None, estimator: str | None) -> None:
    """Refuse an option before anything is explained, so that the line does not blame a file for it."""
    if method is not None:
        from gpca.alignment.methods.registry import make_method

        make_method(method)
    if estimator is not None:
        from gpca.model.pose_spread import spread_estimator

        spread_estimator(estimator, UncertaintySettings())


def _explain_scans(options: Namespace) -> int:
    """Explain scans without any model; returns 0."""
    _require_formats(options)
    T_init = read_pose(options.init) if options.init else None
    sources = [read_scan(source) for source in options.source]
    target = read_scan(options.target)
    _require_known(options.method, None)
    from gpca.model.scan_explainer import explain_scans
    from gpca.model.scan_explanation import LEARNED
    from gpca.process.compilation import say_when_compiling

    say_when_compiling()
    for name, source in zip(options.source, sources, strict=True):
        try:
            explanation = explain_scans(source, target, T_init, options.unit, options.voxel, options.method)
        except InputError as fault:
            raise InputError(name, str(fault)) from fault
        names = {"source": str(name), "target": str(options.target)}
        _print(options, explanation, names)
        _write(options, explanation, names)
    print(LEARNED, file=sys.stderr)
    return 0


def _print(options: Namespace, explanation: Explanation | ScanExplanation, told: dict[str, str]) -> None:
    """Print an explanation; as JSON with what else is told of it."""
    as_json = options.json or options.json_lines
    # A text begins with its warnings.
    warnings = [f"warning: {line}" for line in explanation.warnings] if as_json else []
    for line in (*explanation.notes, *warnings):
        print(line if len(options.source) == 1 else f"{told['source']}: {line}", file=sys.stderr)
    if as_json:
        print(json.dumps(explanation.as_dict() | told), flush=options.json_lines)
    else:
        print(explanation.text(), end="")


def _write(options: Namespace, explanation: Explanation | ScanExplanation, names: dict[str, str]) -> None:
    """Write the page and the figure that were asked for."""
    if options.html:
        explanation.save_html(options.html, names)
        print(f"page {options.html}", file=sys.stderr)
    if options.png:
        import_module(FIGURE).draw_explanation(explanation, options.png, f"{names['source']} to {names['target']}")
        print(f"figure {options.png}", file=sys.stderr)


def _queue(path: Path | None, explainer: Explainer, explanation: Explanation, name: str) -> None:
    """Add a registration to the queue where that is the action; where no file is named, say how."""
    from gpca.recovery.policy import QUEUE

    if explanation.action != QUEUE or explanation.scene is None:
        return
    if path is None:
        print("to label it: explain it with --queue queued.npz, then 'gpca label queued.npz'", file=sys.stderr)
        return
    from gpca.model.queue import add_to_queue

    count = add_to_queue(path, explanation.scene, explainer.embed(explanation.scene.aligned), name)
    print(f"queued in {path}, which holds {count}", file=sys.stderr)
