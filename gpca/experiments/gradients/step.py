"""Step ``gradients``: registrations, encoder and embeddings -> what GP-CA's scores react to, seed by seed."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path

import torch

from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.encoders.registry import DIFFERENTIABLE
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.weights import load_model
from gpca.errors import InputError
from gpca.experiments.gradients.saliency import deletions
from gpca.experiments.gradients.settings import GradientSettings
from gpca.experiments.gradients.tcav import tcav
from gpca.io.arrays import save_arrays
from gpca.io.csv_file import write_csv
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.arguments import SEED, per_seed
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance
from gpca.settings import checked_sections

SECTIONS = {"gradients": ("gradients",), "encoder": ("encoders", "*"), "gpc": ("explainers", "gpca")}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names, one of each per seed; ``--settings`` holds what `SECTIONS` names of the config."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seeds", required=True, type=SEED, nargs="+")
    parser.add_argument("--registrations", required=True, type=Path, nargs="+")
    parser.add_argument("--encoders", required=True, type=Path, nargs="+", help="encoder weights")
    parser.add_argument("--embeddings", required=True, type=Path, nargs="+", help="embeddings from these encoders")
    parser.add_argument(
        "--deletions", required=True, type=Path, nargs="+", help="CSVs of the scores without salient points"
    )
    parser.add_argument("--maps", required=True, type=Path, nargs="+", help="npz files of the saliency maps")
    parser.add_argument("--tcav", required=True, type=Path, nargs="+", help="CSVs of TCAV's scores and tests")


def run(options: Namespace) -> None:
    """Fit GP-CA and follow its gradients, seed by seed."""
    torch.set_num_threads(options.threads)
    given = checked_sections(options.settings, SECTIONS)
    settings, encoding = GradientSettings(**given["gradients"]), EncoderSettings(**given["encoder"])
    if encoding.backbone not in DIFFERENTIABLE:
        fault = "has no gradient with respect to the points once it is trained"
        raise InputError(f"backbone '{encoding.backbone}'", fault, f"use {' or '.join(DIFFERENTIABLE)}")
    files = ("registrations", "encoders", "embeddings", "deletions", "maps", "tcav")
    for seed, *paths in progress(list(per_seed(options, *files)), f"gradients of {options.source}"):
        inputs, outputs = paths[:3], paths[3:]
        with record_provenance(outputs, inputs, options.settings, seed=seed):
            of_seed = (options.source, seed)
            plain = Registrations.load(inputs[0], of_seed)
            registrations = replace(plain, attached=read_embedding(inputs[2], plain))
            train, test = (registrations.subset(registrations.rows(split)) for split in ("train", "test"))
            gpc = GPC(CONCEPTS, GPCSettings(**given["gpc"]), *of_seed)
            gpc.fit(train.embedding, train.concept)
            encoder = load_model(inputs[1], encoding, axes=of_seed).encoder
            rows, maps = deletions(encoder, gpc, registrations, *of_seed, encoding, settings)
            tested = tcav(gpc, train, test, settings, *of_seed)
            write_csv(outputs[0], rows)
            save_arrays(outputs[1], maps, of_seed)
            write_csv(outputs[2], tested)
