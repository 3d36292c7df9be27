"""Step ``embed``: registrations and encoders -> ``embeddings/{source}/{backbone}/{reduction}/seed{seed}.npz``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from time import perf_counter

import torch

from gpca.attribution import read_timings, write_timings
from gpca.dataset import Registrations
from gpca.encoders.training import EncoderSettings, embed, load_encoder
from gpca.files import save_arrays
from gpca.provenance import recorded
from gpca.settings import check_settings
from gpca.steps import per_seed


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names, one of each per seed; ``--settings`` is the encoder's section of the config."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seeds", required=True, type=int, nargs="+")
    parser.add_argument("--registrations", required=True, type=Path, nargs="+")
    parser.add_argument("--registration-timings", required=True, type=Path, nargs="+")
    parser.add_argument("--encoders", required=True, type=Path, nargs="+", help="weights")
    parser.add_argument("--out", required=True, type=Path, nargs="+")
    parser.add_argument("--timings", required=True, type=Path, nargs="+", help="CSVs of the seconds, ICP included")


def run(options: Namespace) -> None:
    """Embed the clouds of every seed."""
    torch.set_num_threads(options.threads)
    check_settings(options.settings, "encoders", "*")
    settings = EncoderSettings(**options.settings)
    jobs = per_seed(options, "registrations", "registration_timings", "encoders", "out", "timings")
    for seed, registrations_path, icp_timings, weights, out, timings in jobs:
        with recorded([out, timings], [registrations_path, weights], options.settings, seed=seed):
            registrations = Registrations.load(registrations_path)
            seconds_S, icp_seconds_S = read_timings(icp_timings, registrations)
            encoder = load_encoder(weights, settings)
            started = perf_counter()
            h_S_d = embed(encoder, registrations, options.source, seed, settings)
            seconds = (perf_counter() - started) / len(h_S_d)
            save_arrays(out, {"h": h_S_d, "sample": registrations.sample, "split": registrations.split})
            write_timings(timings, registrations, seconds_S + seconds, icp_seconds_S)
