"""Step ``explain``: registrations of a user's own -> why they are uncertain and what to do, on stdout."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.errors import InputError
from gpca.model.location import model_path, require_model
from gpca.model.point_file import read_points, read_pose, require_format
from gpca.objects.mesh_folder import METERS_PER_UNIT
from gpca.uncertainty.settings import MONTE_CARLO, UncertaintySettings

UNKNOWN_STATUS = 3  # of the process; 1 is a failed check of another step, 2 a fault of the user's


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and options."""
    parser.add_argument(
        "source", type=Path, nargs="+", help="what was observed: points or a mesh (PLY, PCD, OBJ, STL, OFF)"
    )
    parser.add_argument("target", type=Path, help="the reference that each source is aligned to")
    parser.add_argument("--init", type=Path, help="text file with the 4×4 numbers of T_target_source")
    parser.add_argument("--unit", choices=METERS_PER_UNIT, default="m", help="unit of files and pose (default m)")
    parser.add_argument("--model", type=Path, help="model file (default: GPCA_MODEL, one in ./results/, the package's)")
    parser.add_argument("--method", help="registration method, such as gicp (default: the model's ICP)")
    parser.add_argument(
        "--uncertainty", nargs="?", const=MONTE_CARLO, metavar="ESTIMATOR",
        help="measure the uncertainty of the pose with an estimator such as brossard (default: Monte-Carlo)",
    )  # fmt: skip
    parser.add_argument("--fast", action="store_true", help="re-enact with fewer points and poses, without a promise")
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="print one JSON object")
    form.add_argument("--json-lines", action="store_true", help="print one line of JSON per source")


def run(options: Namespace) -> int:
    """Read all files, then explain and print one source after the other; everything but results goes to stderr.

    The clouds are read before any library is loaded that they do not need: most mistakes are found there.

    Returns:
        `UNKNOWN_STATUS` where one of the explanations means nothing, otherwise 0.
    """
    if options.settings:
        raise InputError("--settings", "is not used by explain", "make another model to change its settings")
    if len(options.source) > 1 and not options.json_lines:
        raise InputError("explain", f"{len(options.source)} sources need one line each", "add --json-lines")
    uncertainty = UncertaintySettings() if options.uncertainty is not None else None
    estimator = MONTE_CARLO if options.uncertainty is None else options.uncertainty
    path = model_path(options.model)
    require_model(path)
    for cloud in (*options.source, options.target):
        require_format(cloud)
    T_init = read_pose(options.init) if options.init else None
    sources = [read_points(source, options.unit)[0] for source in options.source]
    target, frame = read_points(options.target, options.unit)
    _require_known(options.method, options.uncertainty)
    import torch

    from gpca.model.explainer import Explainer
    from gpca.model.file import Model
    from gpca.process.compilation import say_when_compiling

    torch.set_num_threads(options.threads)
    say_when_compiling()
    model = Model.load(path)
    requested = {"uncertainty": uncertainty, "method": options.method, "estimator": estimator, "fast": options.fast}
    explainer = Explainer(model)
    trained_on = f"{model.title} (procedural stand-in)" if model.stand_in else model.title
    status = 0
    for name, source in zip(options.source, sources, strict=True):
        try:
            explanation = explainer.explain(source, target, T_init, options.unit, frame, **requested)
        except InputError as fault:
            raise InputError(name, str(fault)) from fault
        status = UNKNOWN_STATUS if explanation.unknown else status
        as_json = options.json or options.json_lines
        # A text begins with its warnings.
        warnings = [f"warning: {line}" for line in explanation.warnings] if as_json else []
        for line in (*explanation.notes, *warnings):
            print(line if len(sources) == 1 else f"{name}: {line}", file=sys.stderr)
        if as_json:
            names = {"source": str(name), "target": str(options.target), "model": str(path), "trained_on": trained_on}
            print(json.dumps(explanation.as_dict() | names), flush=options.json_lines)
        else:
            print(explanation.text(), end="")
    print(f"model {path}, trained on {trained_on}", file=sys.stderr)
    return status


def _require_known(method: str | None, estimator: str | None) -> None:
    """Refuse an option before anything is explained, so that the line does not blame a file for it."""
    if method is not None:
        from gpca.alignment.methods.registry import make_method

        make_method(method)
    if estimator is not None:
        from gpca.model.pose_spread import spread_estimator

        spread_estimator(estimator, UncertaintySettings())
