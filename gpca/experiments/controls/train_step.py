"""Step ``train_control``: registrations -> embeddings by an encoder that is trained under a control."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

import pandas as pd
import torch

from gpca.encoders.settings import EncoderSettings
from gpca.experiments.controls.encoding import encode, nothing
from gpca.experiments.controls.settings import RETRAINED, TRAININGS, ControlSettings
from gpca.experiments.controls.variants import left_out
from gpca.io.arrays import save_arrays
from gpca.io.csv_file import write_csv
from gpca.pairs.dataset import Registrations
from gpca.process.arguments import SEED
from gpca.process.provenance import record_provenance
from gpca.settings import checked_sections

SECTIONS = {"controls": ("controls",), "encoder": ("encoders", "*")}
CURVE = ("epoch", "learning_rate", "loss", "accuracy")


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds what `SECTIONS` names of the config."""
    parser.add_argument("--control", required=True, choices=(*RETRAINED, *TRAININGS))
    parser.add_argument("--registrations", required=True, type=Path)
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--out", required=True, type=Path, help="embeddings")
    parser.add_argument("--curve", required=True, type=Path, help="CSV of the training curve")


def run(options: Namespace) -> None:
    """Train, keeping a checkpoint, and embed every sample; none where the registrations do not admit the control."""
    torch.set_num_threads(options.threads)
    given = checked_sections(options.settings, SECTIONS)
    settings, encoder = ControlSettings.from_dict(given["controls"]), EncoderSettings(**given["encoder"])
    checkpoint = options.out.with_suffix(".checkpoint")
    with record_provenance([options.out, options.curve], [options.registrations], options.settings, seed=options.seed):
        registrations = Registrations.load(options.registrations, (options.source, options.seed))
        if why := left_out(options.control, registrations, settings, encoder.backbone):
            print(f"control '{options.control}' of {options.source} is skipped: {why}", file=sys.stderr)
            arrays, curve = nothing()
        else:
            axes = (options.source, options.seed, settings, encoder, checkpoint)
            arrays, curve = encode(options.control, registrations, *axes)
        save_arrays(options.out, arrays, registrations.axes)
        write_csv(options.curve, pd.DataFrame(curve, columns=list(CURVE)), form="%.6g")
        checkpoint.unlink(missing_ok=True)
