"""Step ``train``: registrations -> ``encoders/{source}/{backbone}/seed{seed}.pt`` and its training curve."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

import pandas as pd
import torch

from gpca.arguments import SEED
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.training import train_encoder
from gpca.files import whole_file
from gpca.pairs.dataset import Registrations
from gpca.provenance import record_provenance
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` is the encoder's section of the config."""
    parser.add_argument("--registrations", required=True, type=Path)
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--out", required=True, type=Path, help="weights")
    parser.add_argument("--curve", required=True, type=Path, help="CSV of the training curve")


def run(options: Namespace) -> None:
    """Train, keeping a checkpoint beside the weights until they are written."""
    torch.set_num_threads(options.threads)
    check_settings(options.settings, "encoders", "*")
    settings = EncoderSettings(**options.settings)
    registrations = Registrations.load(options.registrations)
    # This is no output of the rule: Snakemake removes those before a rerun, and the rerun is what needs it.
    checkpoint = options.out.with_suffix(".checkpoint")
    with record_provenance([options.out, options.curve], [options.registrations], options.settings, seed=options.seed):
        model, curve = train_encoder(registrations, options.source, options.seed, settings, checkpoint)
        # Where torch.save gets a path, it writes the path's name into the file; here that is the temporary one.
        with whole_file(options.out) as partial, partial.open("wb") as file:
            torch.save(model.state_dict(), file)
        with whole_file(options.curve) as partial:
            pd.DataFrame(curve).to_csv(partial, index=False, float_format="%.6g", lineterminator="\n")
        checkpoint.unlink(missing_ok=True)
