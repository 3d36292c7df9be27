"""Step ``active_learning``: embeddings -> learning curves of every strategy, for one source and seed."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import torch

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
from gpca.process.arguments import SEED, require_files
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance
from gpca.settings import check_settings

PAPERS = ("random", "bald_kmeans")  # the paper's two strategies, which also meet a rare concept


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` is the config's section ``active_learning``."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--registrations", required=True, type=Path)
    parser.add_argument(
        "--embeddings", required=True, type=Path, help="embeddings from an encoder that saw every concept"
    )
    parser.add_argument(
        "--embeddings-without", required=True, type=Path, help="embeddings from encoders that never saw one of them"
    )
    parser.add_argument("--strategies", required=True, nargs="+")
    parser.add_argument("--out", required=True, type=Path, nargs="+", help="one CSV per strategy, in the same order")


def run(options: Namespace) -> None:
    """Run every strategy in every setting for every concept held out."""
    torch.set_num_threads(options.threads)
    check_settings(options.settings, "active_learning")
    require_files(options, "out", len(options.strategies), "strategies")
    for strategy in options.strategies:
        require_known("strategy", strategy, (*STRATEGIES, *STREAMS))
    inputs = [options.registrations, options.embeddings, options.embeddings_without]
    axes = (options.source, options.seed)
    with record_provenance(options.out, inputs, options.settings, seed=options.seed):
        settings = ActiveLearningSettings.from_dict(options.settings)
        stream = StreamSettings(**options.settings.get("stream", {}))
        curves: dict[str, dict] = {strategy: {} for strategy in options.strategies}
        for setting, task, gpc in progress(_tasks(options, settings), f"active learning on {options.source}"):
            for strategy in options.strategies:
                if strategy in STREAMS and setting == "pretrained":
                    curve = run_stream(task, gpc, strategy, settings, stream, *axes)
                elif strategy in STRATEGIES and (setting != "rare" or strategy in PAPERS):
                    labels = (
                        options.settings.get("rare_labels", settings.labels) if setting == "rare" else settings.labels
                    )
                    curve = run_rounds(task, gpc, strategy, replace(settings, labels=labels), *axes, setting)
                else:
                    continue
                curves[strategy][setting, task.held_out] = curve
        for strategy, path in zip(options.strategies, options.out, strict=True):
            write_curves(path, curves[strategy], STREAM_COLUMNS if strategy in STREAMS else POOL_COLUMNS)


def _tasks(options: Namespace, settings: ActiveLearningSettings) -> Iterator[tuple[str, LabelingTask[Projection], GPC]]:
    """Yield setting, task and the GPC that knows two concepts: for each concept held out, and for a rare one."""
    registrations = Registrations.load(options.registrations, (options.source, options.seed))
    held_out = options.settings.get("held_out", CONCEPTS)
    seen_S_d = read_embedding(options.embeddings, registrations)["embedding"]
    shapes = {f"h_{c}": ("S", "d") for c in held_out}
    unseen = load_embeddings(options.embeddings_without, registrations, shapes, "python -m gpca without")
    rare_share = options.settings.get("rare_share")
    chosen = [("pretrained", c, seen_S_d, None) for c in held_out]
    chosen += [("unseen", c, unseen[f"h_{c}"], None) for c in held_out]
    chosen += [("rare", c, seen_S_d, rare_share) for c in held_out if rare_share and c == "overlap"]
    axes = (options.source, options.seed)
    for setting, concept, h_S_d, share in chosen:
        attached = replace(registrations, attached={"embedding": h_S_d})
        task = make_task(attached, concept, settings, *axes, new_share=share)
        gpc = initial_gpc(task, settings, *axes, setting)
        yield setting, task.project(gpc), gpc
