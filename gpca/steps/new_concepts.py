"""Step ``learn_new_concepts``: learning curves of a new concept where no encoder has seen the samples, or it."""

import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.active_learning.rounds import Embedded, NewConceptTrial, run_trial
from gpca.active_learning.settings import FROM_OTHERS, ActiveLearningSettings, NewConceptSettings
from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.descriptors import Descriptors, describe_all
from gpca.causes.drawing import draw_geometry
from gpca.causes.settings import GROUPS, CauseSettings, DescriptorSettings
from gpca.causes.truth import BORDERLINE, GEOMETRY, NOMINAL
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, load_model
from gpca.explainers.pair_classifier import NormalizedFeatures
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.distances import describe_registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.settings import read_settings


def run(job: Job) -> None:
    """Learn every new concept from every embedding."""
    own = read_settings(NewConceptSettings, job.section("new_concepts"))
    inputs = [job.registrations, *job.encoders, job.objects, job.causes, job.descriptors]
    inputs += [job.cause_encoder, job.cause_embeddings]
    with record_provenance(job.out, inputs, job.settings, seed=job.seed):
        settings = ActiveLearningSettings.from_dict(job.section("active_learning"))
        curves: dict[str, dict] = {strategy: {} for strategy in job.strategies}
        for trial in progress(_trials(job, own), f"new concepts of {job.source}"):
            for setting, strategy, curve in run_trial(trial, job.strategies, settings, job.source, job.seed):
                curves[strategy][setting, trial.held_out] = curve
        for strategy, path in zip(job.strategies, job.out, strict=True):
            write_curves(path, curves[strategy], POOL_COLUMNS)


def _trials(job: Job, own: NewConceptSettings) -> Iterator[NewConceptTrial]:
    """Every new concept in every embedding; all files are read before the first, so that faults are found early."""
    axes = (job.source, job.seed)
    encoder, cause_encoder = (EncoderSettings(**job.section(name)) for name in ("encoder", "cause_encoder"))
    registrations = Registrations.load(job.registrations, axes)
    files = zip(job.encoders_of, job.encoders, strict=True)
    models = {name: load_model(path, encoder, unlike=axes) for name, path in files}
    cause_model = load_model(job.cause_encoder, cause_encoder, LABELS, axes)
    causes = Causes.load(job.causes, axes)
    h_S_d = read_embedding(job.cause_embeddings, causes.registrations)["embedding"]
    seen = _seen(causes, h_S_d, Descriptors.load(job.descriptors, causes.registrations))
    objects = ObjectClouds.load(job.objects, job.source)

    def normalized(samples: Embedded) -> Embedded:
        features = NormalizedFeatures(*axes, "new_concepts").fit(samples.embedding[samples.split == "train"])
        return replace(samples, embedding=features(samples.embedding))

    def leave_out(name: str, why: str) -> None:
        print(f"new concepts of {job.source}: '{name}' is skipped: {why}", file=sys.stderr)

    for name in own.embeddings:
        if name == "pair":
            measured_S_F = describe_registrations(registrations, *axes, points=own.points)["relations"]
            samples = normalized(Embedded(measured_S_F, registrations.concept, registrations.split))
        elif name in models:
            h_S_d = embed(models[name], registrations, *axes, encoder)[0]
            samples = Embedded(h_S_d, registrations.concept, registrations.split)
        else:
            leave_out(name, f"it needs {FROM_OTHERS[name]}")
            continue
        for concept in job.section("active_learning").get("held_out", CONCEPTS):
            yield NewConceptTrial(name, samples, concept, CONCEPTS, own.errors if name in own.erring else ())

    # Causes as new concepts: by the causes' encoder, and by the pair's measurements.
    known = tuple(label for label in LABELS if label in seen["encoder"].concept)
    if NOMINAL in own.causes:
        yield NewConceptTrial("pretrained", seen["encoder"], NOMINAL, known)
        yield NewConceptTrial("pair", normalized(seen["pair"]), NOMINAL, known)
    if GEOMETRY in own.causes:
        drawn_by = CauseSettings.from_dict(job.section("causes"), job.section("icp"))
        counts = {"train": own.geometry_train, "test": own.geometry_test}
        drawn = draw_geometry(objects, *axes, drawn_by, counts, own.geometry_candidates)
        if drawn is None:
            leave_out(GEOMETRY, f"none of {own.geometry_candidates} candidates of a split fails without a cause")
            return
        h_G_d = embed(cause_model, drawn.registrations, *axes, cause_encoder)[0]
        descriptors, icp = DescriptorSettings(**job.section("descriptors")), ICPSettings(**job.section("icp"))
        new = _seen(drawn, h_G_d, describe_all(drawn, *axes, descriptors, icp)[0], GEOMETRY)
        both = {name: seen[name].followed_by(new[name]) for name in new}
        yield NewConceptTrial("unseen", both["encoder"], GEOMETRY, (*known, GEOMETRY))
        yield NewConceptTrial("pair", normalized(both["pair"]), GEOMETRY, (*known, GEOMETRY))


def _seen(causes: Causes, h_S_d: np.ndarray, described: Descriptors, label: str | None = None) -> dict[str, Embedded]:
    """Samples with a label, or all with the given one, in the encoder's embedding and as measured."""
    label_S = labels_of(causes.truth) if label is None else np.full(len(causes), label)
    rows = np.flatnonzero(label_S != BORDERLINE)
    by = {"encoder": h_S_d, "pair": np.hstack([described.groups[group] for group in GROUPS])}
    split_S = causes.registrations.split
    return {name: Embedded(array[rows], label_S[rows], split_S[rows]) for name, array in by.items()}
