"""Step ``frame_labels``: learning curves on depth frames, from the embeddings of every backbone and from the pair."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.active_learning.new_concepts import NewConceptTrial, run_trial
from gpca.active_learning.rounds import Embedded
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.experiments.frame_labels.settings import PAIR, FrameLabelSettings
from gpca.explainers.pair_classifier import NormalizedFeatures
from gpca.features.registered import describe_registrations
from gpca.pairs.dataset import Registrations, load_embeddings
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.job import Job
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Learn every concept held out from every embedding."""
    inputs = [job.registrations, *job.embeddings]
    with record_provenance(job.out, inputs, job.settings, seed=job.seed):
        own = FrameLabelSettings(**job.section("frame_labels"))
        changed = {"initial": own.initial, "labels": own.labels}
        settings = ActiveLearningSettings.from_dict(job.section("active_learning") | changed)
        curves: dict[str, dict] = {strategy: {} for strategy in job.strategies}
        for name, samples in progress(_embedded(job, own.points), f"labels of {job.source}"):
            for concept in own.held_out:
                experiment = NewConceptTrial(name, samples, concept, CONCEPTS)
                learnt = run_trial(experiment, job.strategies, settings, job.source, job.seed)
                for setting, strategy, curve in learnt:
                    curves[strategy][setting, concept] = curve
        for strategy, path in zip(job.strategies, job.out, strict=True):
            write_curves(path, curves[strategy], POOL_COLUMNS)


def _embedded(job: Job, points: int) -> Iterator[tuple[str, Embedded]]:
    """Yield the name of each embedding, and the samples in it."""
    registrations = Registrations.load(job.registrations, (job.source, job.seed))

    def samples(h_S_d: np.ndarray) -> Embedded:
        return Embedded(h_S_d, registrations.concept, registrations.split)

    of_backbones = [load_embeddings(path, registrations, {"h": ("S", "d")})["h"] for path in job.embeddings]
    yield from zip(job.backbones, map(samples, of_backbones), strict=True)
    axes = (job.source, job.seed)
    measured_S_F = describe_registrations(registrations, *axes, points=points)["relations"]
    normalized = NormalizedFeatures(*axes, "frame_labels").fit(measured_S_F[registrations.rows("train")])
    yield PAIR, samples(normalized(measured_S_F))
