"""Step ``active_learning``: embeddings -> learning curves of every strategy, for one source and seed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from gpca.active_learning.acquisition import STRATEGIES, STREAMS
from gpca.active_learning.curves import POOL_COLUMNS, STREAM_COLUMNS, write_curves
from gpca.active_learning.rounds import LabelingTask, initial_gpc, make_task, run_rounds
from gpca.active_learning.settings import ActiveLearningSettings, StreamSettings
from gpca.active_learning.stream import run_stream
from gpca.classifier.gpc import GPC
from gpca.classifier.latents import Projection
from gpca.errors import require_known
from gpca.pairs.dataset import Registrations, load_embeddings, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.job import Job
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance

PAPERS = ("random", "bald_kmeans")  # the paper's two strategies, which also meet a rare concept


def run(job: Job) -> None:
    """Run every strategy in every setting for every concept held out."""
    for strategy in job.strategies:
        require_known("strategy", strategy, (*STRATEGIES, *STREAMS))
    inputs = [job.registrations, job.embeddings, job.embeddings_without]
    axes = (job.source, job.seed)
    with record_provenance(job.out, inputs, job.settings, seed=job.seed):
        settings = ActiveLearningSettings.from_dict(job.settings)
        stream = StreamSettings(**job.settings.get("stream", {}))
        curves: dict[str, dict] = {strategy: {} for strategy in job.strategies}
        for setting, task, gpc in progress(_tasks(job, settings), f"active learning on {job.source}"):
            for strategy in job.strategies:
                if strategy in STREAMS and setting == "pretrained":
                    curve = run_stream(task, gpc, strategy, settings, stream, *axes)
                elif strategy in STRATEGIES and (setting != "rare" or strategy in PAPERS):
                    labels = job.settings.get("rare_labels", settings.labels) if setting == "rare" else settings.labels
                    curve = run_rounds(task, gpc, strategy, replace(settings, labels=labels), *axes, setting)
                else:
                    continue
                curves[strategy][setting, task.held_out] = curve
        for strategy, path in zip(job.strategies, job.out, strict=True):
            write_curves(path, curves[strategy], STREAM_COLUMNS if strategy in STREAMS else POOL_COLUMNS)


def _tasks(job: Job, settings: ActiveLearningSettings) -> Iterator[tuple[str, LabelingTask[Projection], GPC]]:
    """Yield setting, task and the GPC that knows two concepts: for each concept held out, and for a rare one."""
    registrations = Registrations.load(job.registrations, (job.source, job.seed))
    held_out = job.settings.get("held_out", CONCEPTS)
    seen_S_d = read_embedding(job.embeddings, registrations)["embedding"]
    shapes = {f"h_{c}": ("S", "d") for c in held_out}
    unseen = load_embeddings(job.embeddings_without, registrations, shapes)
    rare_share = job.settings.get("rare_share")
    chosen = [("pretrained", c, seen_S_d, None) for c in held_out]
    chosen += [("unseen", c, unseen[f"h_{c}"], None) for c in held_out]
    chosen += [("rare", c, seen_S_d, rare_share) for c in held_out if rare_share and c == "overlap"]
    axes = (job.source, job.seed)
    for setting, concept, h_S_d, share in chosen:
        attached = replace(registrations, attached={"embedding": h_S_d})
        task = make_task(attached, concept, settings, *axes, new_share=share)
        gpc = initial_gpc(task, settings, *axes, setting)
        yield setting, task.project(gpc), gpc
