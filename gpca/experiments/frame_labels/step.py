"""Step ``frame_labels``: learning curves on depth frames, from embeddings by backbones and from the pair."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.active_learning.retraining import Retraining, Step, learn
from gpca.active_learning.rounds import Embedded, make_task
from gpca.active_learning.settings import ALL_LABELS, ActiveLearningSettings
from gpca.experiments.frame_labels.settings import PAIR, FrameLabelSettings, rounds_of
from gpca.explainers.pair_classifier import NormalizedFeatures
from gpca.pairs.dataset import Registrations, load_embeddings
from gpca.pairs.description import describe_registrations
from gpca.process.job import Job
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance
from gpca.settings import read_settings


def run(job: Job) -> None:
    """Learn every concept held out from every embedding."""
    inputs = [job.registrations, *job.embeddings]
    axes = (job.source, job.seed)
    with record_provenance(job.out, inputs, job.settings, seed=job.seed):
        own = read_settings(FrameLabelSettings, job.section("frame_labels"))
        rounds = rounds_of(own, job.section("active_learning").get("rare") or {})
        start = ActiveLearningSettings(initial=own.initial)
        curves: dict[str, dict] = {strategy: {} for strategy in job.strategies}
        for name, samples in progress(_embedded(job, own.points), f"labels of {job.source}"):
            for concept in own.held_out:
                task = make_task(samples, concept, start, *axes, new_share=own.share)
                retraining = Retraining(task, rounds.gpc, *axes, name)
                for strategy in job.strategies:
                    if strategy == ALL_LABELS:
                        curve = _of_all_labels(retraining)
                    else:
                        curve = learn(retraining, strategy, rounds, own.targets, *axes, name).steps
                    curves[strategy][name, concept] = curve
        for strategy, path in zip(job.strategies, job.out, strict=True):
            write_curves(path, curves[strategy], POOL_COLUMNS)


def _of_all_labels(retraining: Retraining) -> list[Step]:
    """Return the steps before any label and after those of the whole pool."""
    none: list[int] = []
    rows = list(range(len(retraining.task.pool)))
    return [retraining.look(retraining.fit(queried, None), queried) for queried in (none, rows)]


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
