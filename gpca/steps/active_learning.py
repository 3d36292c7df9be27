"""The steps of active learning: encoders that never saw a concept, and learning curves of it, also on depth frames."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from gpca.active_learning import settings as learning
from gpca.active_learning.acquisition import STREAMS, strategies
from gpca.active_learning.curves import POOL_COLUMNS, STREAM_COLUMNS, write_curves
from gpca.active_learning.retraining import Retraining, learn
from gpca.active_learning.rounds import initial_gpc, make_task, rounds
from gpca.active_learning.stream import run_stream
from gpca.encoders.registry import EncoderSettings
from gpca.errors import require_known
from gpca.explainers.pair_classifier import NormalizedFeatures
from gpca.io.arrays import save_arrays
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.pairs.dataset import Registrations, load_embeddings, read_embedding
from gpca.pairs.distances import describe_registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.settings import fields_of, read_settings

NEW = "overlap"  # the paper's new concept, also learned where it is rare
COMPARED = ("random", "bald_kmeans")  # strategies of the paper's Table III
REDUNDANT = "bald"  # joins them at the first share, because Sec. III-C says that its labels are redundant


def embed_without(job: Job) -> None:
    """Train an encoder on the training samples without each concept, and embed every cloud by it."""
    from gpca.encoders.training import embed, train_encoder

    settings = EncoderSettings(**job.settings)
    with record_provenance([job.out], [job.registrations], job.settings, seed=job.seed):
        registrations = Registrations.load(job.registrations, job.axes)
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
    with record_provenance(job.out, inputs, job.settings, seed=job.seed):
        settings = learning.ActiveLearningSettings.from_dict(job.settings)
        stream = learning.StreamSettings(**job.settings.get("stream", {}))
        held_out = job.settings.get("held_out", CONCEPTS)
        curves: dict[str, dict] = {strategy: {} for strategy in job.strategies}
        loaded = Registrations.load(job.registrations, job.axes)
        registrations = replace(loaded, attached=read_embedding(job.embeddings, loaded))
        unseen = load_embeddings(job.embeddings_without, registrations, {f"h_{c}": ("S", "d") for c in held_out})
        embedded = [("pretrained", c, registrations.embedding) for c in held_out]
        embedded += [("unseen", c, unseen[f"h_{c}"]) for c in held_out]
        for setting, concept, h_S_d in progress(embedded, f"active learning on {job.source}"):
            task = make_task(replace(registrations, attached={"embedding": h_S_d}), concept, settings, *job.axes)
            gpc = initial_gpc(task, settings, *job.axes, setting)
            projected = task.project(gpc)
            for strategy in job.strategies:
                given = projected, gpc, strategy, settings
                if strategy not in STREAMS:
                    curves[strategy][setting, concept] = [step for step, _ in rounds(*given, *job.axes, setting)]
                elif setting == "pretrained":
                    curves[strategy][setting, concept] = run_stream(*given, stream, *job.axes)
        rare = read_settings(learning.RareSettings, job.settings["rare"])
        for share in rare.shares if NEW in held_out else ():
            setting = learning.rare_setting(share)
            task = make_task(registrations, NEW, settings, *job.axes, new_share=share)
            retraining = Retraining(task, rare.gpc, *job.axes, setting)
            compared = (*COMPARED, REDUNDANT) if share == rare.shares[0] else COMPARED
            shown = [name for name in job.strategies if name in compared]
            for strategy in progress(shown, f"{setting} on {job.source}"):
                learned = learn(retraining, strategy, rare, [job.settings["target"]], *job.axes, setting)
                curves[strategy][setting, NEW] = learned.steps
        for strategy, path in zip(job.strategies, job.out, strict=True):
            write_curves(path, curves[strategy], STREAM_COLUMNS if strategy in STREAMS else POOL_COLUMNS)


def learn_on_frames(job: Job) -> None:
    """Learn each new concept on depth frames, from the embeddings of backbones and from the pair."""
    with record_provenance(job.out, [job.registrations, *job.embeddings], job.settings, seed=job.seed):
        settings = read_settings(learning.FrameLabelSettings, job.section("frame_labels"))
        # Rounds as those of a concept that is rare on whole objects, with the budget of frames.
        rare = fields_of(job.section("active_learning")["rare"], learning.RetrainingSettings)
        budget = read_settings(learning.RetrainingSettings, rare | {"labels": settings.labels, "least": settings.least})
        start = learning.ActiveLearningSettings(initial=settings.initial)
        curves: dict[str, dict] = {strategy: {} for strategy in job.strategies}
        for name, samples in progress(_embedded(job, settings.points), f"labels of {job.source}"):
            for concept in settings.held_out:
                task = make_task(samples, concept, start, *job.axes, new_share=settings.share)
                retraining = Retraining(task, budget.gpc, *job.axes, name)
                for strategy in job.strategies:
                    if strategy == learning.ALL_LABELS:  # before any label, and after those of the whole pool
                        queries: list[list[int]] = [[], list(range(len(task.pool)))]
                        curve = [retraining.look(retraining.fit(queried, None), queried) for queried in queries]
                    else:
                        curve = learn(retraining, strategy, budget, settings.targets, *job.axes, name).steps
                    curves[strategy][name, concept] = curve
        for strategy, path in zip(job.strategies, job.out, strict=True):
            write_curves(path, curves[strategy], POOL_COLUMNS)


def _embedded(job: Job, points: int) -> Iterator[tuple[str, Registrations]]:
    """Name of each embedding, and the samples in it."""
    registrations = Registrations.load(job.registrations, job.axes)

    def samples(h_S_d: np.ndarray) -> Registrations:
        return replace(registrations, attached={"embedding": h_S_d})

    of_backbones = [load_embeddings(path, registrations, {"h": ("S", "d")})["h"] for path in job.embeddings]
    yield from zip(job.backbones, map(samples, of_backbones), strict=True)
    measured_S_F = describe_registrations(registrations, *job.axes, points=points)["relations"]
    normalized = NormalizedFeatures(*job.axes, "frame_labels").fit(measured_S_F[registrations.rows("train")])
    yield learning.PAIR, samples(normalized(measured_S_F))
