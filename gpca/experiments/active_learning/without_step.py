"""Step ``without``: registrations -> embeddings by encoders that each never saw one of the concepts."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

import numpy as np
import torch

from gpca.encoders.settings import EncoderSettings
from gpca.encoders.training import embed, train_encoder
from gpca.io.arrays import save_arrays
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.arguments import SEED
from gpca.process.provenance import record_provenance
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` is the encoder's section of the config."""
    parser.add_argument("--registrations", required=True, type=Path)
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument(
        "--concepts", nargs="+", choices=CONCEPTS, default=CONCEPTS, help="concepts to hold out, one at a time"
    )
    parser.add_argument("--out", required=True, type=Path)


def run(options: Namespace) -> None:
    """Train on the training samples of the other concepts and embed every cloud, concept by concept."""
    torch.set_num_threads(options.threads)
    check_settings(options.settings, "encoders", "*")
    settings = EncoderSettings(**options.settings)
    with record_provenance([options.out], [options.registrations], options.settings, seed=options.seed):
        registrations = Registrations.load(options.registrations, (options.source, options.seed))
        train = registrations.rows("train")
        arrays = {"sample": registrations.sample, "split": registrations.split}
        for held_out in options.concepts:
            seen = registrations.subset(train[registrations.concept[train] != held_out])
            name = f"{options.source} without {held_out}"
            model, _ = train_encoder(seen, name, options.seed, settings)
            arrays[f"h_{held_out}"], _ = embed(model, registrations, name, options.seed, settings)
        save_arrays(options.out, {name: np.asarray(array) for name, array in arrays.items()}, registrations.axes)
