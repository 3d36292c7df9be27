"""Step ``kernel_grid``: embeddings -> accuracy and calibration by kernel, learning rate and number of iterations."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import fields, replace
from pathlib import Path

import torch

from gpca.experiments.kernel_grid.grid import KernelGrid, evaluate_grid, write_grid
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.arguments import SEED, per_seed
from gpca.process.provenance import record_provenance
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names, one of each per seed; ``--settings`` is the config's section ``kernel_grid``."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seeds", required=True, type=SEED, nargs="+")
    parser.add_argument("--registrations", required=True, type=Path, nargs="+")
    parser.add_argument("--embeddings", required=True, type=Path, nargs="+")
    parser.add_argument("--out", required=True, type=Path, nargs="+")


def run(options: Namespace) -> None:
    """Evaluate the grid, seed by seed."""
    torch.set_num_threads(options.threads)
    check_settings(options.settings, "kernel_grid")
    known = {field.name for field in fields(KernelGrid)}
    grid = KernelGrid(**{name: value for name, value in options.settings.items() if name in known})
    for seed, registrations, embeddings, out in per_seed(options, "registrations", "embeddings", "out"):
        with record_provenance([out], [registrations, embeddings], options.settings, seed=seed):
            loaded = Registrations.load(registrations, (options.source, seed))
            loaded = replace(loaded, attached=read_embedding(embeddings, loaded))
            write_grid(out, evaluate_grid(loaded, grid, options.source, seed))
