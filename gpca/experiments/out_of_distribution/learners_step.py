"""Step ``learners``: embeddings of all sets -> what every learner says of their test samples."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path

from gpca.errors import InputError
from gpca.experiments.out_of_distribution.learners import predict_sets
from gpca.experiments.out_of_distribution.sets import ShiftedSets
from gpca.explainers.registry import explainer_entry, require_settings
from gpca.io.csv_file import write_csv
from gpca.process.arguments import SEED, per_seed, require_files
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds the settings of every learner by its name."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seeds", required=True, type=SEED, nargs="+")
    parser.add_argument("--learners", required=True, nargs="+")
    parser.add_argument("--sets", required=True, type=Path, nargs="+", help="files of the step shift, one per seed")
    parser.add_argument("--out", required=True, type=Path, nargs="+", help="CSVs, one learner after another")


def run(options: Namespace) -> None:
    """Fit every learner and let it explain, seed by seed."""
    sets_of_seeds = per_seed(options, "sets")
    require_files(options, "out", len(options.learners) * len(options.seeds), "pair(s) of learner and seed")
    for learner in options.learners:
        settings = options.settings.get(learner) or {}
        require_settings(learner, settings)
        check_settings(settings, "explainers", learner)
        if explainer_entry(learner).reads != "embeddings":
            raise InputError(f"learner '{learner}'", "does not read embeddings", "choose another")
    import torch

    torch.set_num_threads(options.threads)
    for i, (seed, path) in enumerate(sets_of_seeds):
        sets = ShiftedSets.load(path, (options.source, seed))
        outputs = options.out[i :: len(options.seeds)]
        title = f"learners on {options.source}, seed {seed}"
        for learner, out in progress(list(zip(options.learners, outputs, strict=True)), title):
            settings = options.settings.get(learner) or {}
            with record_provenance([out], [path], settings, seed=seed):
                make = partial(explainer_entry(learner).make, options.source, seed, **settings)
                write_csv(out, predict_sets(make, sets))
