"""Step ``frame_labels``: learning curves on depth frames, from the embeddings of every backbone and from the pair."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch

from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.active_learning.new_concepts import NewConceptTrial, run_trial
from gpca.active_learning.rounds import Embedded
from gpca.active_learning.settings import NEW_CONCEPT_STRATEGIES, ActiveLearningSettings
from gpca.errors import InputError
from gpca.experiments.frame_labels.settings import PAIR, FrameLabelSettings
from gpca.explainers.pair_classifier import NormalisedDescriptors
from gpca.features.registered import describe_registrations
from gpca.pairs.dataset import Registrations, load_embeddings
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.arguments import SEED
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance
from gpca.settings import checked_sections

SECTIONS = {"frame_labels": ("frame_labels",), "active_learning": ("active_learning",)}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds what `SECTIONS` names of the config."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--registrations", required=True, type=Path)
    parser.add_argument("--backbones", required=True, nargs="+")
    parser.add_argument(
        "--embeddings", required=True, nargs="+", type=Path, help="one file per backbone, in the same order"
    )
    parser.add_argument("--strategies", required=True, nargs="+", choices=NEW_CONCEPT_STRATEGIES)
    parser.add_argument("--out", required=True, type=Path, nargs="+", help="one CSV per strategy, in the same order")


def run(options: Namespace) -> None:
    """Learn every concept held out from every embedding."""
    torch.set_num_threads(options.threads)
    given = checked_sections(options.settings, SECTIONS)
    for several, single in (("out", "strategies"), ("embeddings", "backbones")):
        files, names = getattr(options, several), getattr(options, single)
        if len(files) != len(names):
            raise InputError(
                f"--{several}", f"{len(files)} file(s) for {len(names)} value(s) of --{single}", "give one for each"
            )
    inputs = [options.registrations, *options.embeddings]
    with record_provenance(options.out, inputs, options.settings, seed=options.seed):
        own = FrameLabelSettings(**given["frame_labels"])
        changed = {"initial": own.initial, "labels": own.labels}
        settings = ActiveLearningSettings.from_dict(given["active_learning"] | changed)
        curves: dict[str, dict] = {strategy: {} for strategy in options.strategies}
        for name, samples in progress(_embedded(options, own.points), f"labels of {options.source}"):
            for concept in own.held_out:
                experiment = NewConceptTrial(name, samples, concept, CONCEPTS)
                learnt = run_trial(experiment, options.strategies, settings, options.source, options.seed)
                for setting, strategy, curve in learnt:
                    curves[strategy][setting, concept] = curve
        for strategy, path in zip(options.strategies, options.out, strict=True):
            write_curves(path, curves[strategy], POOL_COLUMNS)


def _embedded(options: Namespace, points: int) -> Iterator[tuple[str, Embedded]]:
    """Yield the name of each embedding, and the samples in it."""
    registrations = Registrations.load(options.registrations, (options.source, options.seed))

    def samples(h_S_d: np.ndarray) -> Embedded:
        return Embedded(h_S_d, registrations.concept, registrations.split)

    of_backbones = [
        load_embeddings(path, registrations, {"h": ("S", "d")}, "python -m gpca embed")["h"]
        for path in options.embeddings
    ]
    yield from zip(options.backbones, map(samples, of_backbones), strict=True)
    axes = (options.source, options.seed)
    measured_S_F = describe_registrations(registrations, *axes, points=points)["relations"]
    normalized = NormalisedDescriptors(*axes, "frame_labels").fit(measured_S_F[registrations.rows("train")])
    yield PAIR, samples(normalized(measured_S_F))
