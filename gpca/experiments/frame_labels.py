"""Labels that a classifier needs for a new concept on depth frames (Sec. IV-E); their numbers join those of frames."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import inf
from typing import Any

from gpca.active_learning.curves import TABLE, collect_curves
from gpca.active_learning.settings import ALL_LABELS, PAIR, FrameLabelSettings
from gpca.declarations.experiment import Experiment, LeftOut
from gpca.declarations.plan import Run
from gpca.declarations.result import Frame, Paths, table
from gpca.declarations.step import Step
from gpca.errors import InputError, require_names
from gpca.experiments.frames import encoder_title, title_of_frames
from gpca.frames.source import REAL_WORLD
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder, mean_over
from gpca.reporting.tables.cells import cell_of_repeats, rows_where
from gpca.reporting.tables.table import Cell, Column, Table

TO_TARGET = ("labels_to_target", "epochs_to_target", "reached")  # metrics that differ by target accuracy
ONE_TARGET = "epochs_at_target"  # left out, because there are several targets


def in_percent(target: float) -> str:
    """A target as in the column `table` of the metrics."""
    return f"{100 * target:.0f}"


def check(config: dict, left_out: LeftOut) -> None:
    """Check the backbones, that the targets differ in percent, and that the labels at the start leave a pool.

    A third of the training samples is of each concept.
    """
    section, train = config["frame_labels"], config["real_world"]["train"]
    require_names("frame_labels.backbones", section["backbones"], config["encoders"], "encoder", left_out("encoders"))
    if len(set(map(in_percent, section["targets"]))) < len(section["targets"]):
        raise InputError("config key frame_labels.targets", "two are equal in whole percent", "remove one")
    if (initial := section["initial"]) // 2 >= train // len(CONCEPTS):
        fault = f"{initial} labeled samples of two concepts leave none of {train} training samples for the pool"
        raise InputError("config key frame_labels.initial", fault, "lower it or raise real_world.train")


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """The seeds, and the backbones that the depth frames have."""
    section = config["frame_labels"]
    return {
        "frame_label_seed": list(config["seeds"])[: section["seeds"]],
        "frame_label_backbone": [name for name in config["real_world"]["backbones"] if name in section["backbones"]],
    }


EXPERIMENT = Experiment(
    name="frame_labels",
    sections={"frame_labels": FrameLabelSettings},
    names=names,
    check=check,
    lists={"frame_labels.backbones": "encoders"},
)

LEARN = Step(
    name="learn_on_frames",
    run="gpca.steps.frame_labels",
    inputs={
        "registrations": "registrations/{frames}/seed{seed}.npz",
        "embeddings": "embeddings/{frames}/{*frame_label_backbone}/none/seed{seed}.npz",
    },
    outputs={"out": "frame_labels/{frames}/{*strategy}/seed{seed}.csv"},
    where={"strategy": "new_concept_strategy"},
    settings=lambda plan, wildcards: {
        "frame_labels": plan.config["frame_labels"],
        "active_learning": {"rare": plan.config["active_learning"]["rare"]},
    },
    params={"source": REAL_WORLD, "backbones": lambda plan, wildcards: plan.names["frame_label_backbone"]},
    priority=4,
)


def collect_labels(label_files: Paths, targets: Iterable[float]) -> list[Frame]:
    """Metrics of learning curves on depth frames, by seed, for targets of the accuracy on the test samples.

    The column `table` names the embedding, ``active_learning/{backbone}`` or ``active_learning/pair``. Metrics that
    depend on the target have it in percent behind, ``active_learning/{backbone}/70``.
    """
    by_target = {in_percent(target): collect_curves(label_files, target) for target in targets}
    whole = next(iter(by_target.values()))
    return [whole[~whole["metric"].isin((*TO_TARGET, ONE_TARGET))]] + [
        curves[curves["metric"].isin(TO_TARGET)].assign(table=lambda rows, end=percent: rows["table"] + f"/{end}")
        for percent, curves in by_target.items()
    ]


STRATEGIES = {"bald_kmeans": "BALD, to {} % (labels)", "random": "Random, to {} % (labels)"}
ENDS = {  # column -> metric, strategy, and how it is shown
    "start": ("start_accuracy", "random", Column("Start (%)", interval=False)),
    "final": ("final_accuracy", "bald_kmeans", Column("BALD, all queries (%)")),
    "all_labels": ("final_accuracy", ALL_LABELS, Column("All labels (%)")),
}


@table(
    "IV-E Real-world validation",
    "Depth frames: labels needed for a new concept",
    """How many labels a classifier needs on depth frames, chosen by BALD with k-means or at random, to the paper's
    target of 70 % and to its neighbors (Sec. IV-E): on the embeddings of DGCNN, the paper's backbone, beside those
    of another, and on measurements of the pair. In bold is the strategy that needs fewer labels.""",
    after="real_world_failures",
    metrics="real_world.csv",
)
def table6_labels(run: Run, metrics: Frame) -> Table:
    """Labels that BALD and random choice need, by target, and accuracies: embeddings × strategies."""
    section, frames = run.config["frame_labels"], run.config["real_world"]
    percents = [in_percent(target) for target in section["targets"]]
    labels = {f"{strategy}_{percent}": (strategy, percent) for percent in percents for strategy in STRATEGIES}
    builder = TableBuilder("table6_labels", {"seen": "Seen by"})
    encoders = {name: encoder_title(name, "none") for name in frames["backbones"]}
    for name, title in {**encoders, PAIR: "Measurements of the pair"}.items():

        def cell(metric: str, strategy: str, factor: float = 1, end: str = "", of: str = TABLE + name) -> Cell | None:
            rows = rows_where(metrics, source=REAL_WORLD, table=of + end, method=strategy)
            values_R = factor * rows_where(rows, metric=metric).groupby("seed")["value"].mean()
            missed = bool(end) and bool((rows_where(rows, metric="reached")["value"] < 1).any())
            return cell_of_repeats(values_R, frames["test"] * len(values_R), at_least=missed)

        cells = {key: cell("labels_to_target", of, end=f"/{percent}") for key, (of, percent) in labels.items()}
        cells |= {key: cell(metric, strategy, 100) for key, (metric, strategy, _) in ENDS.items()}
        builder.add_row([(name, title)], cells)
    for percent in percents:
        builder.compare_across([f"{strategy}_{percent}" for strategy in STRATEGIES])
    new = " or ".join(section["held_out"])
    return builder.build(
        caption=f"Labels until a GPC to which {new} is new is as accurate on {title_of_frames(run.config)}",
        column_head="quantity",
        columns={
            key: Column(STRATEGIES[strategy].format(percent), decimals=0, limits=(0, inf), least_is_best=True)
            for key, (strategy, percent) in labels.items()
        }
        | {key: column for key, (_, _, column) in ENDS.items()},
        footnotes=(
            f"{mean_over(builder.most_seeds(), frames['test'])}. Bold: the fewer labels of the two to a target, "
            "whether or not their intervals overlap; neither where they are equal.",
            f"Start: {section['initial']} labeled samples of the two known concepts. Pool: their other training "
            f"samples, of {frames['train']} with those of the new concept, and as many of the new one as make up "
            f"{100 * section['share']:g} % of it. The paper's classifier is fitted anew in each round, as in Table "
            f"III, until all targets are reached, to {section['least']} labels at least and {section['labels']} "
            "at most; '>': some runs did not reach the target. Encoders saw every concept.",
            "All labels: of a classifier that learns the whole pool. DGCNN's row is compared with the paper's numbers.",
        ),
    )
