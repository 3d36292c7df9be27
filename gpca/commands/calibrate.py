"""Command ``calibrate``: calibrates the alarm and the state sets of a model on a user's own registrations."""

import sys
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from dataclasses import replace
from pathlib import Path

from gpca.commands.explain import COLUMNS, FILES, from_rows, inputs_in, target_reader
from gpca.errors import InputError
from gpca.io.files import require_apart
from gpca.model.clouds import require_format
from gpca.model.location import model_path, require_model
from gpca.numerals import decimal
from gpca.objects.surface import METERS_PER_UNIT

LARGEST_RISK = 0.5


def _risk(text: str) -> float:
    try:
        risk = decimal(text)
    except ValueError as fault:
        raise ArgumentTypeError(str(fault)) from fault
    if not 0 < risk <= LARGEST_RISK:
        raise ArgumentTypeError(f"{text} is not above 0 and at most {LARGEST_RISK}")
    return risk


def add_calibrate_arguments(parser: ArgumentParser) -> None:
    add = parser.add_argument
    label = "label (right, or wrong, or instead of wrong the cause: noise, pose, overlap or several)"
    columns = f"the columns source, target and {label}, and optionally group"
    add("pairs", type=Path, help=f"CSV as for 'gpca explain --pairs', with {columns}")
    add("--out", required=True, type=Path, metavar="FILE", help="model file to write")
    add("--tolerance", default="3%", help="largest error of a right pose: 5mm, 2deg or 3%% (default)")
    risk = "largest share of failed registrations called good, and of good ones called failed (default 0.05)"
    add("--risk", type=_risk, default=0.05, help=risk)
    add("--unit", choices=METERS_PER_UNIT, default="m", help="unit of files and poses (default m)")
    add("--source-unit", choices=METERS_PER_UNIT, help="unit of the sources, if it differs")
    add("--model", type=Path, help="model to start from (default: that of 'gpca explain')")
    add("--method", help="registration method, such as gicp (default: the model's ICP)")


def run_calibrate(options: Namespace) -> None:
    path = model_path(options.model)
    require_model(path)
    rows = from_rows(options, (*COLUMNS, "label"))
    files = [options.pairs.parent / name for _, row in rows for key in FILES if (name := row.get(key))]
    require_apart(options, ["out"], [path, *files])
    labels = [(row["label"] or "").strip() for _, row in rows]
    groups = [(row.get("group") or "").strip() for _, row in rows]
    given_groups = groups if any(groups) else None
    from gpca.model.calibration import LabeledRegistrations, require_labels

    names = [place for place, _ in rows]
    require_labels(labels, given_groups, names)  # before anything is registered
    inputs = []
    for place, row in rows:
        try:
            inputs.append(inputs_in(row, options))
            for cloud in (inputs[-1].source, inputs[-1].target):
                require_format(cloud)
        except InputError as fault:
            raise InputError(place, str(fault)) from fault
    from gpca.model.explainer import Explainer
    from gpca.model.file import Model
    from gpca.model.result import Tolerance
    from gpca.process.progress import progress

    tolerance = Tolerance.parse(options.tolerance)
    explainer = Explainer(Model.load(path))
    diagnoses = []
    read_target = target_reader(False)
    for place, each in zip(names, progress(inputs, "explaining", unit=" pairs"), strict=True):
        try:
            given = each.read(read_target)
            explanation = explainer.explain(**given, method=options.method, tolerance=tolerance)
        except InputError as fault:
            raise InputError(place, str(fault)) from fault
        diagnoses.append(explanation.diagnosis)
    labeled = LabeledRegistrations.of(diagnoses, labels, given_groups, names, options.risk)
    model = replace(explainer.model, diagnoser=labeled.set_in(explainer.model.diagnoser))
    model.save(options.out)
    for line in labeled.report():
        print(line)
    print(f"model {options.out}: {model.learning}", file=sys.stderr)
