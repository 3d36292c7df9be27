"""Step ``learn_new_concepts``: learning curves of a new concept where no encoder has seen the samples, or it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.active_learning.rounds import Embedded, NewConceptTrial, run_trial
from gpca.active_learning.settings import (
    FROM_OTHERS,
    ActiveLearningSettings,
    NewConceptSettings,
)
from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.descriptors import Descriptors, describe_all
from gpca.causes.drawing import draw_geometry
from gpca.causes.settings import GROUPS, CauseSettings, DescriptorSettings
from gpca.causes.truth import BORDERLINE, GEOMETRY, NOMINAL
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, load_model
from gpca.explainers.pair_classifier import NormalizedFeatures
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.description import describe_registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.job import Job
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance
from gpca.settings import read_settings


def run(job: Job) -> None:
    """Learn every new concept from every embedding."""
    own = read_settings(NewConceptSettings, job.section("new_concepts"))
    inputs = [job.registrations, *job.encoders, job.objects, job.causes, job.descriptors]
    inputs += [job.cause_encoder, job.cause_embeddings]
    with record_provenance(job.out, inputs, job.settings, seed=job.seed):
        settings = ActiveLearningSettings.from_dict(job.section("active_learning"))
        work = _Work(job, own)
        curves: dict[str, dict] = {strategy: {} for strategy in job.strategies}
        for experiment in progress(work.experiments(), f"new concepts of {job.source}"):
            for setting, strategy, curve in run_trial(experiment, job.strategies, settings, job.source, job.seed):
                curves[strategy][setting, experiment.held_out] = curve
        for strategy, path in zip(job.strategies, job.out, strict=True):
            write_curves(path, curves[strategy], POOL_COLUMNS)


class _Work:
    """The files of one source and seed; all are read before the first experiment, so that faults are found early."""

    def __init__(self, job: Job, own: NewConceptSettings) -> None:
        self._job = job
        self._own = own
        self._axes = (job.source, job.seed)
        self._encoder = EncoderSettings(**job.section("encoder"))
        self._cause_encoder = EncoderSettings(**job.section("cause_encoder"))
        self._registrations = Registrations.load(job.registrations, self._axes)
        self._models = {
            name: load_model(path, self._encoder, unlike=self._axes)
            for name, path in zip(job.encoders_of, job.encoders, strict=True)
        }
        self._cause_model = load_model(job.cause_encoder, self._cause_encoder, LABELS, self._axes)
        causes = Causes.load(job.causes, self._axes)
        h_S_d = read_embedding(job.cause_embeddings, causes.registrations)["embedding"]
        self._seen = _seen(causes, h_S_d, Descriptors.load(job.descriptors, causes.registrations))
        self._objects = ObjectClouds.load(job.objects, job.source)

    def experiments(self) -> Iterator[NewConceptTrial]:
        """Yield every new concept, in every embedding."""
        registrations = self._registrations
        for name, h_S_d in self._embeddings(registrations):
            samples = Embedded(h_S_d, registrations.concept, registrations.split)
            errors = self._own.errors if name in self._own.erring else ()
            for concept in self._job.section("active_learning").get("held_out", CONCEPTS):
                yield NewConceptTrial(name, samples, concept, CONCEPTS, errors)
        yield from self._of_causes()

    def _embeddings(self, registrations: Registrations) -> Iterator[tuple[str, np.ndarray]]:
        """Yield each embedding's name and the samples (S, d) in it."""
        measured_S_F = describe_registrations(registrations, *self._axes, points=self._own.points)["relations"]
        pair_S_F = _normalized(measured_S_F, registrations.split == "train", *self._axes)
        for name in self._own.embeddings:
            if name == "pair":
                yield name, pair_S_F
            elif name in self._models:
                yield name, embed(self._models[name], registrations, *self._axes, self._encoder)[0]
            else:
                _leave_out(self._job.source, name, f"it needs {FROM_OTHERS[name]}")

    def _of_causes(self) -> Iterator[NewConceptTrial]:
        """Yield the experiments with causes as new concepts: by the causes' encoder, and by the pair's measurements."""
        seen = self._seen
        known = tuple(label for label in LABELS if label in seen["encoder"].concept)
        if NOMINAL in self._own.causes:
            yield NewConceptTrial("pretrained", seen["encoder"], NOMINAL, known)
            yield NewConceptTrial("pair", self._normalized(seen["pair"]), NOMINAL, known)
        if GEOMETRY in self._own.causes and (drawn := self._geometry()) is not None:
            h_G_d = embed(self._cause_model, drawn.registrations, *self._axes, self._cause_encoder)[0]
            icp = ICPSettings(**self._job.section("icp"))
            descriptors = DescriptorSettings(**self._job.section("descriptors"))
            new = _seen(drawn, h_G_d, describe_all(drawn, *self._axes, descriptors, icp)[0], GEOMETRY)
            both = {name: seen[name].followed_by(new[name]) for name in new}
            yield NewConceptTrial("unseen", both["encoder"], GEOMETRY, (*known, GEOMETRY))
            yield NewConceptTrial("pair", self._normalized(both["pair"]), GEOMETRY, (*known, GEOMETRY))

    def _geometry(self) -> Causes | None:
        drawn = draw_geometry(
            self._objects,
            *self._axes,
            CauseSettings.from_dict(self._job.section("causes"), self._job.section("icp")),
            {"train": self._own.geometry_train, "test": self._own.geometry_test},
            self._own.geometry_candidates,
        )
        if drawn is None:
            why = f"none of {self._own.geometry_candidates} candidates of a split fails without a cause"
            _leave_out(self._job.source, GEOMETRY, why)
        return drawn

    def _normalized(self, samples: Embedded) -> Embedded:
        return replace(samples, embedding=_normalized(samples.embedding, samples.split == "train", *self._axes))


def _normalized(measured_S_F: np.ndarray, train_S: np.ndarray, *axes: object) -> np.ndarray:
    return NormalizedFeatures(*axes, "new_concepts").fit(measured_S_F[train_S])(measured_S_F)


def _seen(causes: Causes, h_S_d: np.ndarray, described: Descriptors, label: str | None = None) -> dict[str, Embedded]:
    """Samples with a label, or all with the given one, in the encoder's embedding and as measured."""
    label_S = labels_of(causes.truth) if label is None else np.full(len(causes), label)
    rows = np.flatnonzero(label_S != BORDERLINE)
    by = {"encoder": h_S_d, "pair": np.hstack([described.groups[group] for group in GROUPS])}
    split_S = causes.registrations.split
    return {name: Embedded(array[rows], label_S[rows], split_S[rows]) for name, array in by.items()}


def _leave_out(source: str, name: str, why: str) -> None:
    print(f"new concepts of {source}: '{name}' is skipped: {why}", file=sys.stderr)
