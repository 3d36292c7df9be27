"""Step ``runtime``: model, registrations and embeddings -> ``runtime.csv``, the seconds of every stage."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path

import torch

from gpca.active_learning.rounds import make_task
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.experiments.runtime.runtime import measure
from gpca.io.csv_file import write_csv
from gpca.model.file import Model
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.arguments import SEED
from gpca.process.provenance import record_provenance
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds ``runtime`` and ``active_learning`` of the config."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--model", required=True, type=Path)
    parser.add_argument("--registrations", required=True, type=Path, help="registrations that the model was trained on")
    parser.add_argument("--embeddings", required=True, type=Path, help="embeddings from its encoder")
    parser.add_argument("--out", required=True, type=Path)


def run(options: Namespace) -> None:
    """Measure every component, repeat by repeat."""
    torch.set_num_threads(options.threads)
    runtime, learning = (options.settings.get(name) or {} for name in ("runtime", "active_learning"))
    check_settings(runtime, "runtime")
    check_settings(learning, "active_learning")
    axes = (options.source, options.seed)
    inputs = [options.model, options.registrations, options.embeddings]
    with record_provenance([options.out], inputs, options.settings, seed=options.seed):
        model = Model.load(options.model)
        registrations = Registrations.load(options.registrations, axes)
        embedded = replace(registrations, attached=read_embedding(options.embeddings, registrations))
        settings = ActiveLearningSettings.from_dict(learning)
        task = make_task(embedded, "overlap", settings, *axes)
        repeats = runtime.get("repeats", 100)
        write_csv(options.out, measure(model, registrations, task, settings, repeats, options.threads, *axes))
