"""Step ``train``: registrations -> ``encoders/{source}/{backbone}/seed{seed}.pt`` and its training curve.

The encoder of depth frames starts from one that was trained on the registrations of all sources together.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

import numpy as np
import pandas as pd
import torch

from gpca.alignment.icp import ICPSettings
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.training import train_encoder
from gpca.encoders.weights import load_model, write_weights
from gpca.errors import InputError
from gpca.frames.sample_file import read_instances_of
from gpca.io.csv_file import write_csv
from gpca.pairs.dataset import Registrations, joined
from gpca.pairs.reading import read_as
from gpca.process.arguments import SEED, require_files
from gpca.process.provenance import record_provenance
from gpca.settings import checked_with_icp


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` is the encoder's section of the config, with ``icp``."""
    parser.add_argument(
        "--registrations", required=True, type=Path, nargs="+", help="one or more files, trained on together"
    )
    parser.add_argument(
        "--registrations-of", nargs="+", help="source of each of these files, where it is another than --source"
    )
    parser.add_argument("--poses", type=Path, help="CSV of depth frames, whose instances are held out as a whole")
    parser.add_argument("--start", type=Path, help="weights to start from")
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--out", required=True, type=Path, help="weights")
    parser.add_argument("--curve", required=True, type=Path, help="CSV of the training curve")


def run(options: Namespace) -> None:
    """Train, keeping a checkpoint beside the weights until they are written."""
    torch.set_num_threads(options.threads)
    given, of_icp = checked_with_icp(options.settings, "encoders", "*")
    settings, icp = EncoderSettings(**given), ICPSettings(**of_icp)
    of = options.registrations_of or [options.source]
    require_files(options, "registrations", len(of), "source(s)")
    files = zip(options.registrations, of, strict=True)
    registrations = joined([Registrations.load(path, (source, options.seed)) for path, source in files])
    # Clouds of frames are as small as objects look, so some of their points are drawn twice; others are as configured.
    if options.poses is None and settings.draw_points > (most := int(np.diff(registrations.offsets).max())):
        fault = f"the largest cloud has {most} points, fewer than draw_points, {settings.draw_points}"
        raise InputError(options.registrations[0], fault, "lower draw_points, or raise cloud_points of registrations")
    instance_S = read_instances_of(options.poses, registrations) if options.poses else None
    start = load_model(options.start, settings).state_dict() if options.start else None
    # This is no output of the rule: Snakemake removes those before a rerun, and the rerun is what needs it.
    checkpoint = options.out.with_suffix(".checkpoint")
    inputs = [*options.registrations, *(path for path in (options.poses, options.start) if path)]
    with record_provenance([options.out, options.curve], inputs, options.settings, seed=options.seed):
        seen = read_as(settings.reading, registrations, icp)
        model, curve = train_encoder(
            seen, options.source, options.seed, settings, checkpoint, start=start, group_S=instance_S
        )
        write_weights(options.out, model, (options.source, options.seed))
        write_csv(options.curve, pd.DataFrame(curve), form="%.6g")
        checkpoint.unlink(missing_ok=True)
