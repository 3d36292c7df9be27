"""Step ``reduce``: embeddings -> shorter ones, ``embeddings/{source}/{backbone}/{reduction}/seed{seed}.npz``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.encoders.reduction import make_reduction, reduce
from gpca.errors import InputError
from gpca.io.arrays import REAL, TEXT, WHOLE, load_arrays, save_arrays
from gpca.process.arguments import SEED, per_seed
from gpca.process.provenance import record_provenance
from gpca.settings import check_settings

SHAPES = {"h": ("S", "d"), "head_logits": ("S", "C"), "sample": ("S",), "split": ("S",)}
KINDS = {"h": REAL, "head_logits": REAL, "sample": WHOLE, "split": TEXT}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names, one file of each kind per seed; ``--settings`` are the reduction's in the config."""
    parser.add_argument("--reduction", required=True)
    parser.add_argument("--source", required=True)
    parser.add_argument("--seeds", required=True, type=SEED, nargs="+")
    parser.add_argument(
        "--embeddings", required=True, type=Path, nargs="+", help="embeddings as written by the step embed"
    )
    parser.add_argument("--out", required=True, type=Path, nargs="+")


def run(options: Namespace) -> None:
    """Fit on the training rows and reduce every row, seed by seed; all else is kept as it is."""
    make_reduction(options.reduction, options.settings)
    check_settings(options.settings, "reductions", options.reduction)
    for seed, embeddings, out in per_seed(options, "embeddings", "out"):
        with record_provenance([out], [embeddings], options.settings, seed=seed):
            arrays = load_arrays(embeddings, SHAPES, "python -m gpca embed", KINDS, (options.source, seed))
            h_S_d = arrays["h"]
            train_S = arrays["split"] == "train"
            if not train_S.any():
                raise InputError(embeddings, "has no training samples", "regenerate it with 'python -m gpca embed'")
            axes = (options.source, seed, "reduction")
            reduced_S_c = reduce(options.reduction, h_S_d[train_S], h_S_d, options.settings, *axes)
            save_arrays(out, {name: arrays[name] for name in SHAPES} | {"h": reduced_S_c}, (options.source, seed))
