"""Steps ``embed_without`` and ``learn_actively``: encoders that never saw a concept, and learning curves of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from gpca.active_learning.acquisition import STREAMS, strategies
from gpca.active_learning.curves import POOL_COLUMNS, STREAM_COLUMNS, write_curves
from gpca.active_learning.retraining import Retraining, Step, learn
from gpca.active_learning.rounds import LabelingTask, initial_gpc, make_task, run_rounds
from gpca.active_learning.settings import ActiveLearningSettings, RareSettings, StreamSettings, rare_setting
from gpca.active_learning.stream import run_stream
from gpca.classifier.gpc import GPC
from gpca.classifier.latents import Projection
from gpca.encoders.registry import EncoderSettings
from gpca.errors import require_known
from gpca.io.arrays import save_arrays
from gpca.pairs.dataset import Registrations, load_embeddings, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.job import Job
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance
from gpca.settings import read_settings

NEW = "overlap"  # the paper's new concept, also learned where it is rare
COMPARED = ("random", "bald_kmeans")  # strategies of the paper's Table III
REDUNDANT = "bald"  # joins them at the first share, because Sec. III-C says that its labels are redundant


def embed_without(job: Job) -> None:
    """Train an encoder on the training samples without each concept, and embed every cloud by it."""
    from gpca.encoders.training import embed, train_encoder

    settings = EncoderSettings(**job.settings)
    with record_provenance([job.out], [job.registrations], job.settings, seed=job.seed):
        registrations = Registrations.load(job.registrations, (job.source, job.seed))
        train = registrations.rows("train")
        arrays = {"sample": registrations.sample, "split": registrations.split}
        for held_out in job.concepts:
            seen = registrations.subset(train[registrations.concept[train] != held_out])
            name = f"{job.source} without {held_out}"
            model, _ = train_encoder(seen, name, job.seed, settings)
            arrays[f"h_{held_out}"], _ = embed(model, registrations, name, job.seed, settings)
        save_arrays(job.out, {name: np.asarray(array) for name, array in arrays.items()}, registrations.axes)


def learn_actively(job: Job) -> None:
    """Learning curves of every strategy in every setting for every concept held out."""
    for strategy in job.strategies:
        require_known("strategy", strategy, (*strategies(), *STREAMS))
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
                elif strategy not in STREAMS:
                    curve = run_rounds(task, gpc, strategy, settings, *axes, setting)
                else:
                    continue
                curves[strategy][setting, task.held_out] = curve
        for setting, strategy, curve in _rare_curves(job, settings):
            curves[strategy][setting, NEW] = curve
        for strategy, path in zip(job.strategies, job.out, strict=True):
            write_curves(path, curves[strategy], STREAM_COLUMNS if strategy in STREAMS else POOL_COLUMNS)


def _tasks(job: Job, settings: ActiveLearningSettings) -> Iterator[tuple[str, LabelingTask[Projection], GPC]]:
    """Yield setting, task and the GPC that knows two concepts, for each concept held out."""
    registrations = _embedded(job)
    held_out = job.settings.get("held_out", CONCEPTS)
    shapes = {f"h_{c}": ("S", "d") for c in held_out}
    unseen = load_embeddings(job.embeddings_without, registrations, shapes)
    chosen = [("pretrained", c, registrations.embedding) for c in held_out]
    chosen += [("unseen", c, unseen[f"h_{c}"]) for c in held_out]
    axes = (job.source, job.seed)
    for setting, concept, h_S_d in chosen:
        attached = replace(registrations, attached={"embedding": h_S_d})
        task = make_task(attached, concept, settings, *axes)
        gpc = initial_gpc(task, settings, *axes, setting)
        yield setting, task.project(gpc), gpc


def _rare_curves(job: Job, settings: ActiveLearningSettings) -> Iterator[tuple[str, str, list[Step]]]:
    """Yield setting, strategy and curve of the paper's experiment, in which the new concept is rare."""
    if not (section := job.settings.get("rare")) or NEW not in job.settings.get("held_out", CONCEPTS):
        return
    rare = read_settings(RareSettings, section)
    registrations, axes = _embedded(job), (job.source, job.seed)
    for share in rare.shares:
        task: LabelingTask[np.ndarray] = make_task(registrations, NEW, settings, *axes, new_share=share)
        setting = rare_setting(share)
        retraining = Retraining(task, rare.gpc, *axes, setting)
        compared = (*COMPARED, REDUNDANT) if share == rare.shares[0] else COMPARED
        for strategy in progress([name for name in job.strategies if name in compared], f"{setting} on {job.source}"):
            yield setting, strategy, learn(retraining, strategy, rare, [job.settings["target"]], *axes, setting).steps


def _embedded(job: Job) -> Registrations:
    """Samples in the embedding of the encoder that saw all concepts."""
    registrations = Registrations.load(job.registrations, (job.source, job.seed))
    return replace(registrations, attached=read_embedding(job.embeddings, registrations))
