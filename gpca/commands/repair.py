"""Command ``repair``: puts a user's wrong registrations right, on stdout."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.commands.explain import add_registration_arguments, run_explain

# What `explain` alone can do.
LEFT_OUT = dict.fromkeys(("save_pose", "estimator", "png", "queue")) | {"uncertainty": False, "fast": False}


def add_repair_arguments(parser: ArgumentParser) -> None:
    add_registration_arguments(parser, "put right as it is: nothing is registered first")
    out = "write the pose that is good or repaired; where none is, nothing is written"
    parser.add_argument("--out", type=Path, metavar="FILE", help=out)
    parser.set_defaults(**LEFT_OUT, repair=False, repairs_alone=True)


def run_repair(options: Namespace) -> int:
    """Return 0 if each is good or repaired, else the largest of `gpca.model.repaired.STATUSES`, or 2."""
    return run_explain(options)
