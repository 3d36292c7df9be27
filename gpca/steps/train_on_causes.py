"""Step ``train_on_causes``: causes -> weights of an encoder that tells their labels apart, and its embeddings."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from time import perf_counter

import pandas as pd
import torch

from gpca.attribution.predictions import read_timings, write_timings
from gpca.causes.dataset import Causes
from gpca.causes.labels import LABELS, with_label
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.training import TrainingTask, embed, train_encoder
from gpca.encoders.weights import write_weights
from gpca.io.arrays import save_arrays
from gpca.io.csv_file import write_csv
from gpca.process.arguments import SEED
from gpca.process.provenance import record_provenance
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` is ``diagnosis.encoder``."""
    parser.add_argument("--causes", required=True, type=Path)
    parser.add_argument("--causes-timings", required=True, type=Path)
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--weights", required=True, type=Path)
    parser.add_argument("--curve", required=True, type=Path, help="CSV of the training curve")
    parser.add_argument("--out", required=True, type=Path, help="embeddings")
    parser.add_argument("--timings", required=True, type=Path, help="CSV of the run times, including ICP")


def run(options: Namespace) -> None:
    """Train on the training samples that have a label, keeping a checkpoint, and embed every sample."""
    torch.set_num_threads(options.threads)
    check_settings(options.settings, "diagnosis", "encoder")
    settings = EncoderSettings(**options.settings)
    checkpoint = options.weights.with_suffix(".checkpoint")
    axes = (options.source, options.seed)
    outputs = [options.weights, options.curve, options.out, options.timings]
    inputs = [options.causes, options.causes_timings]
    with record_provenance(outputs, inputs, options.settings, seed=options.seed):
        causes = Causes.load(options.causes, axes)
        registrations = causes.registrations
        seconds_S, icp_seconds_S = read_timings(options.causes_timings, registrations)
        model, curve = train_encoder(with_label(causes), *axes, settings, checkpoint, TrainingTask(LABELS))
        started = perf_counter()
        h_S_d, logits_S_C = embed(model, registrations, *axes, settings)
        seconds = (perf_counter() - started) / len(h_S_d)
        write_weights(options.weights, model, axes)
        write_csv(options.curve, pd.DataFrame(curve), form="%.6g")
        arrays = {"h": h_S_d, "head_logits": logits_S_C, "sample": registrations.sample, "split": registrations.split}
        save_arrays(options.out, arrays, axes)
        write_timings(options.timings, registrations, seconds_S + seconds, icp_seconds_S)
        checkpoint.unlink(missing_ok=True)
