"""Step ``estimate``: registrations with measured causes -> what every estimator says of their poses' covariance."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.alignment.methods.registry import require_local
from gpca.arguments import SEED
from gpca.causes.dataset import Causes
from gpca.csv_file import write_csv
from gpca.errors import InputError
from gpca.objects.canonical import ObjectClouds
from gpca.provenance import record_provenance
from gpca.settings import check_settings
from gpca.steps import per_seed
from gpca.trials.covariances import REFERENCE, ReferenceSamples
from gpca.trials.estimation import try_estimators
from gpca.trials.judge import Judges
from gpca.trials.settings import EstimatorPairSettings
from gpca.uncertainty.estimators.registry import require_estimator_settings

SECTIONS = ("estimator_pairs", "estimators")


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds the config's sections ``estimator_pairs`` and ``estimators``."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seeds", required=True, type=SEED, nargs="+")
    parser.add_argument("--estimators", required=True, nargs="+")
    parser.add_argument("--objects", required=True, type=Path)
    parser.add_argument("--causes", required=True, type=Path, nargs="+", help="one per seed")
    parser.add_argument("--samples", required=True, type=Path, nargs="+", help="npz of the reference, one per seed")
    parser.add_argument("--out", required=True, type=Path, nargs="+", help="CSVs: reference, then each estimator")
    parser.add_argument("--timings", required=True, type=Path, nargs="+", help="CSVs of their seconds, in that order")


def run(options: Namespace) -> None:
    """Ask every estimator, seed by seed."""
    import torch

    torch.set_num_threads(options.threads)
    if unknown := sorted(set(options.settings) - set(SECTIONS)):
        raise InputError(f"setting {unknown[0]}", "unknown", f"known are {', '.join(SECTIONS)}")
    pairs = options.settings.get("estimator_pairs", {})
    check_settings(pairs, "estimator_pairs")
    settings = EstimatorPairSettings(**pairs)
    for name in settings.methods:
        require_local(name)
    own = options.settings.get("estimators", dict.fromkeys(options.estimators))
    check_settings(own, "estimators")
    for name in (*own, *options.estimators):
        require_estimator_settings(name, own.get(name) or {})
    estimators = {name: own.get(name) or {} for name in options.estimators}
    wanted = len((REFERENCE, *estimators)) * len(options.seeds)
    for option in ("out", "timings"):
        if (given := len(getattr(options, option))) != wanted:
            remedy = "give one for the reference and each estimator, per seed"
            raise InputError(f"--{option}", f"{given} file(s), not {wanted}", remedy)
    judges = Judges(ObjectClouds.load(options.objects), f"objects of {options.source}")
    for i, (seed, path, samples) in enumerate(per_seed(options, "causes", "samples")):
        of_seed = slice(i, None, len(options.seeds))
        out, timings = options.out[of_seed], options.timings[of_seed]
        inputs = [options.objects, path]
        with record_provenance([*out, *timings, samples], inputs, options.settings, seed=seed):
            rows, cases = try_estimators(Causes.load(path), judges, options.source, seed, estimators, settings)
            ReferenceSamples.of(cases).save(samples)
            for of_estimator, own_out, own_timings in zip(rows.values(), out, timings, strict=True):
                write_csv(own_out, of_estimator.drop(columns="seconds"))
                write_csv(own_timings, of_estimator[["sample", "method", "seconds"]])
