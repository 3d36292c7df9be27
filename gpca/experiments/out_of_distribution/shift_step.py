"""Step ``shift``: registrations and encoder -> samples unlike the training samples, embedded, and their distances."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path

import torch

from gpca.encoders.settings import EncoderSettings
from gpca.encoders.weights import load_model
from gpca.errors import InputError
from gpca.experiments.out_of_distribution.samples import make_sets
from gpca.experiments.out_of_distribution.settings import ShiftSettings
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.arguments import SEED, per_seed
from gpca.process.provenance import record_provenance
from gpca.settings import checked_sections

SECTIONS = {"shift": ("shift",), "registrations": ("registrations",), "encoder": ("encoders", "*")}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names, one of each per seed; ``--settings`` holds ``shift``, ``registrations``, ``encoder``."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seeds", required=True, type=SEED, nargs="+")
    parser.add_argument("--objects", required=True, type=Path)
    parser.add_argument("--registrations", required=True, type=Path, nargs="+")
    parser.add_argument(
        "--other-registrations",
        type=Path,
        nargs="*",
        help="registrations of another source; without them, this set is skipped",
    )
    parser.add_argument("--embeddings", required=True, type=Path, nargs="+")
    parser.add_argument("--encoders", required=True, type=Path, nargs="+", help="encoder weights")
    parser.add_argument("--out", required=True, type=Path, nargs="+")


def run(options: Namespace) -> None:
    """Make the sets, seed by seed."""
    torch.set_num_threads(options.threads)
    given = checked_sections(options.settings, SECTIONS)
    settings = ShiftSettings.from_dicts(**given)
    encoder_settings = EncoderSettings(**given["encoder"])
    options.other_registrations = options.other_registrations or [None] * len(options.seeds)
    objects = ObjectClouds.load(options.objects, options.source)
    files = ("registrations", "other_registrations", "embeddings", "encoders", "out")
    for seed, own, other, embeddings, weights, out in per_seed(options, *files):
        inputs = [path for path in (options.objects, own, other, embeddings, weights) if path]
        with record_provenance([out], inputs, options.settings, seed=seed):
            axes = (options.source, seed)
            registrations = Registrations.load(own, axes)
            registrations = replace(registrations, attached=read_embedding(embeddings, registrations))
            others = _of_another_source(other, options.source) if other else None
            model = load_model(weights, encoder_settings, axes=axes)
            sets = make_sets(objects, registrations, others, model, encoder_settings, *axes, settings)
            sets.save(out, axes)


def _of_another_source(path: Path, own: str) -> Registrations:
    registrations = Registrations.load(path)
    if registrations.axes is not None and registrations.axes[0] == own:
        raise InputError(path, f"is of source '{own}' itself", "give registrations of another source")
    return registrations
