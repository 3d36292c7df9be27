"""Step ``new_concepts``: learning curves of a new concept where no encoder has seen the samples, or the concept."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.active_learning.new_concepts import NewConceptTrial, run_trial
from gpca.active_learning.rounds import Embedded
from gpca.active_learning.settings import (
    FROM_OTHERS,
    NEW_CONCEPT_STRATEGIES,
    ActiveLearningSettings,
    NewConceptSettings,
)
from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import Causes
from gpca.causes.drawing import draw_geometry
from gpca.causes.labels import LABELS, labels_of
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import BORDERLINE, GEOMETRY, NOMINAL
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.training import embed
from gpca.encoders.weights import load_model
from gpca.experiments.new_concepts.self_supervision import self_supervised
from gpca.explainers.pair_classifier import NormalisedDescriptors
from gpca.features.dataset import Descriptors, describe_all
from gpca.features.groups import GROUPS
from gpca.features.registered import describe_registrations
from gpca.features.settings import DescriptorSettings
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.arguments import SEED, require_files
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance
from gpca.settings import checked_sections

SECTIONS = {
    "new_concepts": ("new_concepts",),
    "active_learning": ("active_learning",),
    "encoder": ("encoders", "*"),
    "cause_encoder": ("diagnosis", "encoder"),
    "causes": ("causes",),
    "descriptors": ("diagnosis", "descriptors"),
    "icp": ("registrations", "icp"),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds what `SECTIONS` names of the config."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--registrations", required=True, type=Path)
    parser.add_argument(
        "--encoders", nargs="*", default=[], type=Path, help="weights trained on other samples and sources"
    )
    parser.add_argument(
        "--encoders-of",
        nargs="*",
        default=[],
        choices=FROM_OTHERS,
        help="what each encoder was trained on, in the same order",
    )
    parser.add_argument("--objects", required=True, type=Path)
    parser.add_argument("--causes", required=True, type=Path)
    parser.add_argument("--descriptors", required=True, type=Path, help="descriptors of the causes")
    parser.add_argument("--cause-encoder", required=True, type=Path, help="weights trained on the causes")
    parser.add_argument("--cause-embeddings", required=True, type=Path, help="embeddings from that encoder")
    parser.add_argument("--strategies", required=True, nargs="+", choices=NEW_CONCEPT_STRATEGIES)
    parser.add_argument("--out", required=True, type=Path, nargs="+", help="one CSV per strategy, in the same order")


def run(options: Namespace) -> None:
    """Learn every new concept from every embedding."""
    torch.set_num_threads(options.threads)
    given = checked_sections(options.settings, SECTIONS)
    own = NewConceptSettings.from_dict(given["new_concepts"])
    require_files(options, "out", len(options.strategies), "value(s) of --strategies")
    require_files(options, "encoders", len(options.encoders_of), "value(s) of --encoders-of")
    inputs = [options.registrations, *options.encoders, options.objects, options.causes, options.descriptors]
    inputs += [options.cause_encoder, options.cause_embeddings]
    with record_provenance(options.out, inputs, options.settings, seed=options.seed):
        settings = ActiveLearningSettings.from_dict(given["active_learning"])
        work = _Work(options, given, own)
        curves: dict[str, dict] = {strategy: {} for strategy in options.strategies}
        for experiment in progress(work.experiments(), f"new concepts of {options.source}"):
            learnt = run_trial(experiment, options.strategies, settings, options.source, options.seed)
            for setting, strategy, curve in learnt:
                curves[strategy][setting, experiment.held_out] = curve
        for strategy, path in zip(options.strategies, options.out, strict=True):
            write_curves(path, curves[strategy], POOL_COLUMNS)


class _Work:
    """What the experiments of one source and seed read; all files are read at once, so that a fault is found first."""

    def __init__(self, options: Namespace, given: dict[str, dict], own: NewConceptSettings) -> None:
        self._options = options
        self._given = given
        self._own = own
        self._axes = (options.source, options.seed)
        self._encoder = EncoderSettings(**given["encoder"])
        self._cause_encoder = EncoderSettings(**given["cause_encoder"])
        self._registrations = Registrations.load(options.registrations, self._axes)
        self._models = {
            name: load_model(path, self._encoder, unlike=self._axes)
            for name, path in zip(options.encoders_of, options.encoders, strict=True)
        }
        self._cause_model = load_model(
            options.cause_encoder, self._cause_encoder, LABELS, self._axes, step="train_on_causes"
        )
        causes = Causes.load(options.causes, self._axes)
        h_S_d = read_embedding(options.cause_embeddings, causes.registrations, "train_on_causes")["embedding"]
        self._seen = _seen(causes, h_S_d, Descriptors.load(options.descriptors, causes.registrations))
        self._objects = ObjectClouds.load(options.objects, options.source)

    def experiments(self) -> Iterator[NewConceptTrial]:
        """Yield every new concept, in every embedding."""
        registrations = self._registrations
        for name, h_S_d in self._embeddings(registrations):
            samples = Embedded(h_S_d, registrations.concept, registrations.split)
            errors = self._own.errors if name in self._own.erring else ()
            for concept in self._given["active_learning"].get("held_out", CONCEPTS):
                yield NewConceptTrial(name, samples, concept, CONCEPTS, errors)
        yield from self._of_causes()

    def _embeddings(self, registrations: Registrations) -> Iterator[tuple[str, np.ndarray]]:
        """Yield each embedding's name and the samples (S, d) in it."""
        measured_S_F = describe_registrations(registrations, *self._axes, points=self._own.points)["relations"]
        pair_S_F = _normalized(measured_S_F, registrations.split == "train", *self._axes)
        for name in self._own.embeddings:
            if name == "pair":
                yield name, pair_S_F
            elif name == "self_supervised":
                own = EncoderSettings(**self._given["encoder"] | self._given["new_concepts"].get("encoder", {}))
                yield name, self_supervised(registrations, pair_S_F, *self._axes, own)
            elif name in self._models:
                yield name, embed(self._models[name], registrations, *self._axes, self._encoder)[0]
            else:
                _leave_out(self._options.source, name, f"it needs {FROM_OTHERS[name]}")

    def _of_causes(self) -> Iterator[NewConceptTrial]:
        """Yield what has causes as new concepts: by the encoder of the causes, and by what was measured of the pair."""
        seen = self._seen
        known = tuple(label for label in LABELS if label in seen["encoder"].concept)
        if NOMINAL in self._own.causes:
            yield NewConceptTrial("pretrained", seen["encoder"], NOMINAL, known)
            yield NewConceptTrial("pair", self._normalized(seen["pair"]), NOMINAL, known)
        if GEOMETRY in self._own.causes and (drawn := self._geometry()) is not None:
            h_G_d = embed(self._cause_model, drawn.registrations, *self._axes, self._cause_encoder)[0]
            icp, descriptors = ICPSettings(**self._given["icp"]), DescriptorSettings(**self._given["descriptors"])
            new = _seen(drawn, h_G_d, describe_all(drawn, *self._axes, descriptors, icp)[0], GEOMETRY)
            both = {name: seen[name].followed_by(new[name]) for name in new}
            yield NewConceptTrial("unseen", both["encoder"], GEOMETRY, (*known, GEOMETRY))
            yield NewConceptTrial("pair", self._normalized(both["pair"]), GEOMETRY, (*known, GEOMETRY))

    def _geometry(self) -> Causes | None:
        drawn = draw_geometry(
            self._objects,
            *self._axes,
            CauseSettings.from_dict(self._given["causes"], self._given["icp"]),
            {"train": self._own.geometry_train, "test": self._own.geometry_test},
            self._own.geometry_candidates,
        )
        if drawn is None:
            why = f"none of {self._own.geometry_candidates} candidates of a split fails without a cause"
            _leave_out(self._options.source, GEOMETRY, why)
        return drawn

    def _normalized(self, samples: Embedded) -> Embedded:
        return replace(samples, embedding=_normalized(samples.embedding, samples.split == "train", *self._axes))


def _normalized(measured_S_F: np.ndarray, train_S: np.ndarray, *axes: object) -> np.ndarray:
    return NormalisedDescriptors(*axes, "new_concepts").fit(measured_S_F[train_S])(measured_S_F)


def _seen(causes: Causes, h_S_d: np.ndarray, described: Descriptors, label: str | None = None) -> dict[str, Embedded]:
    """Return the samples that have a label, or all with the one given, by the encoder and by what was measured."""
    label_S = labels_of(causes.truth) if label is None else np.full(len(causes), label)
    rows = np.flatnonzero(label_S != BORDERLINE)
    by = {"encoder": h_S_d, "pair": np.hstack([described.groups[group] for group in GROUPS])}
    split_S = causes.registrations.split
    return {name: Embedded(array[rows], label_S[rows], split_S[rows]) for name, array in by.items()}


def _leave_out(source: str, name: str, why: str) -> None:
    print(f"new concepts of {source}: '{name}' is skipped: {why}", file=sys.stderr)
