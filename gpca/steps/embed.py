"""Step ``embed``: registrations and encoder -> ``embeddings/{source}/{backbone}/{reduction}/seed{seed}.npz``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from time import perf_counter

import torch

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import read_timings, write_timings
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.training import embed
from gpca.encoders.weights import load_model
from gpca.io.arrays import save_arrays
from gpca.pairs.dataset import Registrations
from gpca.pairs.reading import read_as
from gpca.process.arguments import SEED
from gpca.process.provenance import record_provenance
from gpca.settings import checked_with_icp


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` is the encoder's section of the config, with ``icp``."""
    parser.add_argument("--registrations", required=True, type=Path)
    parser.add_argument("--registration-timings", required=True, type=Path)
    parser.add_argument("--encoder", required=True, type=Path, help="encoder weights")
    parser.add_argument("--encoder-of", help="source of the encoder, where it is another than --source")
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--timings", required=True, type=Path, help="CSV of the run times, including ICP")


def run(options: Namespace) -> None:
    """Embed every cloud."""
    torch.set_num_threads(options.threads)
    given, of_icp = checked_with_icp(options.settings, "encoders", "*")
    settings, icp = EncoderSettings(**given), ICPSettings(**of_icp)
    inputs, axes = [options.registrations, options.encoder], (options.source, options.seed)
    with record_provenance([options.out, options.timings], inputs, options.settings, seed=options.seed):
        registrations = Registrations.load(options.registrations, axes)
        seconds_S, icp_seconds_S = read_timings(options.registration_timings, registrations)
        model = load_model(options.encoder, settings, axes=(options.encoder_of or options.source, options.seed))
        started = perf_counter()
        seen = read_as(settings.reading, registrations, icp)
        h_S_d, logits_S_C = embed(model, seen, *axes, settings)
        seconds = (perf_counter() - started) / len(h_S_d)
        arrays = {"h": h_S_d, "head_logits": logits_S_C, "sample": registrations.sample, "split": registrations.split}
        save_arrays(options.out, arrays, axes)
        write_timings(options.timings, registrations, seconds_S + seconds, icp_seconds_S)
