"""Step ``learn_on_frames``: learning curves of a new concept on depth frames, from embeddings and from the pair."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.active_learning.retraining import Retraining, learn
from gpca.active_learning.rounds import Embedded, make_task
from gpca.active_learning.settings import (
    ALL_LABELS,
    PAIR,
    ActiveLearningSettings,
    FrameLabelSettings,
    RetrainingSettings,
)
from gpca.explainers.pair_classifier import NormalizedFeatures
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.pairs.dataset import Registrations, load_embeddings
from gpca.pairs.distances import describe_registrations
from gpca.process.progress import progress
from gpca.settings import fields_of, read_settings


def run(job: Job) -> None:
    """Learn each new concept from each embedding."""
    inputs = [job.registrations, *job.embeddings]
    axes = (job.source, job.seed)
    with record_provenance(job.out, inputs, job.settings, seed=job.seed):
        settings = read_settings(FrameLabelSettings, job.section("frame_labels"))
        rounds = rounds_of(settings, job.section("active_learning").get("rare") or {})
        start = ActiveLearningSettings(initial=settings.initial)
        curves: dict[str, dict] = {strategy: {} for strategy in job.strategies}
        for name, samples in progress(_embedded(job, settings.points), f"labels of {job.source}"):
            for concept in settings.held_out:
                task = make_task(samples, concept, start, *axes, new_share=settings.share)
                retraining = Retraining(task, rounds.gpc, *axes, name)
                for strategy in job.strategies:
                    if strategy == ALL_LABELS:  # before any label, and after those of the whole pool
                        queries: list[list[int]] = [[], list(range(len(task.pool)))]
                        curve = [retraining.look(retraining.fit(queried, None), queried) for queried in queries]
                    else:
                        curve = learn(retraining, strategy, rounds, settings.targets, *axes, name).steps
                    curves[strategy][name, concept] = curve
        for strategy, path in zip(job.strategies, job.out, strict=True):
            write_curves(path, curves[strategy], POOL_COLUMNS)


def rounds_of(settings: FrameLabelSettings, rare: Mapping[str, Any]) -> RetrainingSettings:
    """Rounds as those of a concept that is rare on whole objects, with the budget of frames."""
    shared = fields_of(rare, RetrainingSettings)
    return read_settings(RetrainingSettings, shared | {"labels": settings.labels, "least": settings.least})


def _embedded(job: Job, points: int) -> Iterator[tuple[str, Embedded]]:
    """Name of each embedding, and the samples in it."""
    registrations = Registrations.load(job.registrations, (job.source, job.seed))

    def samples(h_S_d: np.ndarray) -> Embedded:
        return Embedded(h_S_d, registrations.concept, registrations.split)

    of_backbones = [load_embeddings(path, registrations, {"h": ("S", "d")})["h"] for path in job.embeddings]
    yield from zip(job.backbones, map(samples, of_backbones), strict=True)
    axes = (job.source, job.seed)
    measured_S_F = describe_registrations(registrations, *axes, points=points)["relations"]
    normalized = NormalizedFeatures(*axes, "frame_labels").fit(measured_S_F[registrations.rows("train")])
    yield PAIR, samples(normalized(measured_S_F))
