"""Step ``explain``: one registration of a user's own -> why it is uncertain and what to do, on stdout."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

import torch

from gpca.errors import InputError
from gpca.model.explainer import Explainer
from gpca.model.file import Model, model_path
from gpca.model.point_file import read_points, read_pose
from gpca.model.pose_spread import MONTE_CARLO
from gpca.objects.mesh_folder import METRES_PER_UNIT
from gpca.uncertainty.settings import UncertaintySettings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and options."""
    parser.add_argument("source", type=Path, help="what was observed: points or a mesh (PLY, PCD, OBJ, STL, OFF)")
    parser.add_argument("target", type=Path, help="the reference that it is aligned to")
    parser.add_argument("--init", type=Path, help="text file of T_target_source where ICP starts, 4×4 numbers")
    parser.add_argument("--unit", choices=METRES_PER_UNIT, default="m", help="of files and pose (default m)")
    parser.add_argument("--model", type=Path, help="by default that of GPCA_MODEL, or one in ./results/")
    parser.add_argument("--method", help="registration method by its name, gicp for one; by default the model's ICP")
    parser.add_argument(
        "--uncertainty", nargs="?", const=MONTE_CARLO, metavar="ESTIMATOR",
        help="measure how uncertain the pose is, by an estimator such as brossard; by default Monte-Carlo",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(options: Namespace) -> None:
    """Read, explain and print; all that is no result goes to stderr."""
    torch.set_num_threads(options.threads)
    if options.settings:
        raise InputError("--settings", "explain has none", "they are in the model; make another one")
    path = model_path(options.model)
    model = Model.load(path)
    T_init = read_pose(options.init) if options.init else None
    source, _ = read_points(options.source, options.unit)
    target, frame = read_points(options.target, options.unit)
    uncertainty = UncertaintySettings() if options.uncertainty is not None else None
    estimator = MONTE_CARLO if options.uncertainty is None else options.uncertainty
    asked = {"uncertainty": uncertainty, "method": options.method, "estimator": estimator}
    explanation = Explainer(model).explain(source, target, T_init, options.unit, frame, **asked)
    trained_on = f"{model.title} (procedural stand-in)" if model.stand_in else model.title
    for note in (*explanation.notes, f"model {path}, trained on {trained_on}"):
        print(note, file=sys.stderr)
    if options.json:
        print(json.dumps(explanation.as_dict() | {"model": str(path), "trained_on": trained_on}))
    else:
        print(explanation.text(), end="")
