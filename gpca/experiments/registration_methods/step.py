"""Step ``register_methods``: registrations -> their test pairs registered by every method, and how far each is off."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.alignment.methods.registry import require_settings
from gpca.experiments.registration_methods.settings import PairSettings
from gpca.experiments.registration_methods.trial import try_methods
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.process.arguments import SEED, per_seed, require_files
from gpca.process.provenance import record_provenance
from gpca.settings import checked_by_name, checked_sections

SECTIONS = {"method_pairs": ("method_pairs",)}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds the config's sections ``method_pairs`` and ``methods``."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seeds", required=True, type=SEED, nargs="+")
    parser.add_argument("--methods", required=True, nargs="+")
    parser.add_argument("--objects", required=True, type=Path)
    parser.add_argument("--registrations", required=True, type=Path, nargs="+", help="one per seed")
    parser.add_argument("--out", required=True, type=Path, nargs="+", help="CSVs, one method after another")
    parser.add_argument("--timings", required=True, type=Path, nargs="+", help="CSVs of their run times, in that order")


def run(options: Namespace) -> None:
    """Register by every method, seed by seed."""
    given = checked_sections(options.settings, SECTIONS, by_name=("methods",))
    settings = PairSettings(**given["method_pairs"])
    methods = checked_by_name(given["methods"], "methods", options.methods, require_settings)
    for option in ("out", "timings"):
        require_files(options, option, len(methods) * len(options.seeds), "pair(s) of method and seed")
    objects = ObjectClouds.load(options.objects, options.source)
    for i, (seed, path) in enumerate(per_seed(options, "registrations")):
        of_seed = slice(i, None, len(options.seeds))
        outputs = options.out[of_seed], options.timings[of_seed]
        inputs = [options.objects, path]
        with record_provenance([*outputs[0], *outputs[1]], inputs, options.settings, seed=seed):
            registrations = Registrations.load(path, (options.source, seed))
            trials = try_methods(registrations, objects, options.source, seed, methods, settings)
            for rows, out, timings in zip(trials.values(), *outputs, strict=True):
                write_csv(out, rows.drop(columns="seconds"))
                write_csv(timings, rows[["sample", "start", "seconds"]])
