"""Step ``estimate``: registrations with measured causes -> what every estimator says of their poses' covariance."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.alignment.methods.registry import require_local
from gpca.causes.dataset import Causes
from gpca.experiments.estimators.covariances import REFERENCE
from gpca.experiments.estimators.estimation import reference_samples, try_estimators
from gpca.experiments.estimators.settings import EstimatorPairSettings
from gpca.experiments.judge import Judges
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import ObjectClouds
from gpca.process.arguments import SEED, per_seed, require_files
from gpca.process.provenance import record_provenance
from gpca.settings import checked_by_name, checked_sections
from gpca.uncertainty.estimators.registry import require_estimator_settings

SECTIONS = {"estimator_pairs": ("estimator_pairs",)}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds the config's sections ``estimator_pairs`` and ``estimators``."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seeds", required=True, type=SEED, nargs="+")
    parser.add_argument("--estimators", required=True, nargs="+")
    parser.add_argument("--objects", required=True, type=Path)
    parser.add_argument("--causes", required=True, type=Path, nargs="+", help="one per seed")
    parser.add_argument(
        "--samples", required=True, type=Path, nargs="+", help="npz files of the reference, one per seed"
    )
    parser.add_argument(
        "--out", required=True, type=Path, nargs="+", help="CSVs of the reference, then of each estimator"
    )
    parser.add_argument("--timings", required=True, type=Path, nargs="+", help="CSVs of their run times, in that order")


def run(options: Namespace) -> None:
    """Ask every estimator, seed by seed."""
    import torch

    torch.set_num_threads(options.threads)
    given = checked_sections(options.settings, SECTIONS, by_name=("estimators",))
    settings = EstimatorPairSettings(**given["estimator_pairs"])
    for name in settings.methods:
        require_local(name)
    estimators = checked_by_name(given["estimators"], "estimators", options.estimators, require_estimator_settings)
    for option in ("out", "timings"):
        wanted = len((REFERENCE, *estimators)) * len(options.seeds)
        require_files(options, option, wanted, "pair(s) of reference or estimator and seed")
    judges = Judges(ObjectClouds.load(options.objects, options.source), f"objects of {options.source}")
    for i, (seed, path, samples) in enumerate(per_seed(options, "causes", "samples")):
        axes = (options.source, seed)
        of_seed = slice(i, None, len(options.seeds))
        out, timings = options.out[of_seed], options.timings[of_seed]
        inputs = [options.objects, path]
        with record_provenance([*out, *timings, samples], inputs, options.settings, seed=seed):
            rows, cases = try_estimators(Causes.load(path, axes), judges, *axes, estimators, settings)
            reference_samples(cases).save(samples, axes)
            for of_estimator, own_out, own_timings in zip(rows.values(), out, timings, strict=True):
                write_csv(own_out, of_estimator.drop(columns="seconds"))
                write_csv(own_timings, of_estimator[["sample", "method", "seconds"]])
