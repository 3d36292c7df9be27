"""Tables of depth frames: Table VI, by backbone and reduction, and by seen and unseen objects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from gpca.encoders.registry import make_encoder, parameter_count
from gpca.evaluation.intervals import UNTRAINED
from gpca.evaluation.measures import ALL
from gpca.experiments.explained import titles
from gpca.experiments.frame_accuracies import DATASET, SEEN, UNSEEN
from gpca.experiments.frames import (
    BACKBONES,
    CLASSIC,
    REDUCTIONS,
    TOGETHER,
    encoder_title,
    published_backbones,
    reduced_backbones,
    title_of_frames,
)
from gpca.experiments.plan import Run
from gpca.experiments.result import table
from gpca.explainers.registry import explainer_entry
from gpca.frames.source import ONE_ENCODER, REAL_WORLD, conditions_of
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder, crossed, over_clusters
from gpca.reporting.tables.cells import cell_of_repeats, clustered_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import dataset_in_words, plural

if TYPE_CHECKING:
    import pandas as pd

PUBLISHED_NOTE = "readings of which architecture the paper used; they are not compared with what it prints."
NOT_SHARES = ("ece", "nll", "icp_calls")  # of which there is one number for all samples
SCENES = "scenes"  # the clusters
EVERYTHING_SEEN = {TOGETHER: "All (%)", SEEN: "Seen objects (%)", UNSEEN: "Unseen objects (%)"}

POSES = {"results": "Pose estimators", "true_pose": "True pose, small error"}  # titles by form; all others:
GLOBAL_POSE = "Global registration"
NUMBERS = {"intervals": "real_world_intervals.csv", "metrics": "real_world.csv"}
SECTION = "IV-D Ablation studies"


@table(
    SECTION,
    "Table VI: backbones and reductions",
    """Table VI of the paper: accuracy of GP-CA on objects in depth frames, by encoder and by reduction of the
    embedding, with the paper's classic features below. Beside each share are its interval and the standard
    deviation over the seeds, which the paper prints. In the full protocol, encoders as published stand below the
    judged ones.""",
    name="table6_backbones",
    paper=True,
    **NUMBERS,
)
def table6_of_encoders(run: Run, intervals: pd.DataFrame, metrics: pd.DataFrame) -> Table:
    """:func:`table6_backbones` of a run, with the parameters of its encoders counted."""
    frames = run.config["real_world"]

    def counted(names: Iterable[str]) -> dict[str, int]:
        settings = {name: run.config["encoders"][name] for name in names}
        return {
            name: parameter_count(make_encoder(each["backbone"], each.get("options", {})))
            for name, each in settings.items()
        }

    return table6_backbones(
        intervals,
        metrics,
        title_of_frames(run.config),
        counted(frames["backbones"]),
        list(frames["reductions"]),
        pretrained_on(frames),
        titles(frames["explainers"]),
        counted(frames["published"].values()),
    )


def pretrained_on(frames: Mapping) -> str:
    """Data that the encoders of frames are trained on before the frames; empty where there is none."""
    if not frames["pretraining"]:
        return ""
    if not frames["virtual"]:
        return "whole objects"
    tested = frames["virtual"]["objects"] == "all"
    of = "the models of all objects" if tested else "models of objects that no tested frame shows"
    return f"whole objects and on frames rendered of {of}"


def table6_backbones(
    intervals: pd.DataFrame,
    metrics: pd.DataFrame,
    title: str,
    backbones: Mapping[str, int],
    reductions: Sequence[str],
    pretrained_on: str = "",
    explainers: Mapping[str, str] | None = None,
    published: Mapping[str, int] | None = None,
) -> Table:
    """Return the accuracy on depth frames by backbones × reductions, and of the classic features.

    Args:
        backbones: The number of parameters of each name, in order. The table shows differences to the first backbone
            with the first reduction.
        reductions: The names of the reductions, in order.
        pretrained_on: What the encoders learned from before the frames, if anything.
        explainers: The titles of the other explainers on frames, of which those without training stand last.
        published: The number of parameters of each encoder whose published architecture stands beside the judged one.
    """
    together = rows_where(metrics, table=TOGETHER)
    metrics, one_encoder = (rows_where(together, source=source) for source in (REAL_WORLD, ONE_ENCODER))
    intervals = rows_where(intervals, table=TOGETHER, source=REAL_WORLD)
    first = next(iter(backbones))
    table = TableBuilder("table6_backbones", {"backbone": "Backbone", "reduction": "Reduction"})
    for backbone, parameters in backbones.items():
        for reduction in reductions:
            labels = [(backbone, BACKBONES.get(backbone, backbone)), (reduction, REDUCTIONS[reduction])]
            method = f"{backbone}-{reduction}"
            cells = _cells(intervals, metrics, method, parameters)
            table.add_row(labels, cells | {"classifiers": _deviation(one_encoder, method)} if cells else {})
    beside = {name: BACKBONES.get(name, name) for name in published or {}}
    seeds_beside: set[int] = set()
    for (name, reduction), labels in crossed(beside, {name: REDUCTIONS[name] for name in reductions}):
        cells = _cells(intervals, metrics, f"{name}-{reduction}", (published or {})[name])
        seeds_beside |= {cell.seeds for cell in cells.values() if cell}
        table.add_row(labels, cells, rival=False)
    untrained = {name: title for name, title in (explainers or {}).items() if name in UNTRAINED}
    for method, name in {**CLASSIC, **untrained}.items():
        labels = [(method, name), ("none", REDUCTIONS["none"])]
        table.add_row(labels, _cells(intervals, metrics, method))
    table.compare_down(["accuracy"])
    shown = table.first_cell("accuracy")
    few = max(seeds_beside, default=shown.seeds)
    fewer = f", over the first {plural(few, 'seed')}" if few < shown.seeds else ""
    rival = f"To {BACKBONES.get(first, first)}"
    encoder = f"encoder that goes on from one pretrained on {pretrained_on}" if pretrained_on else "encoder"
    other = " without reduction" if reductions[0] == "none" else f" with {REDUCTIONS[reductions[0]]}"
    return table.build(
        caption=f"GP-CA by backbone and dimensionality reduction, accuracy (%) on {title}",
        column_head="metric",
        columns={
            "accuracy": Column("Mean acc. (%)"),
            "classifiers": Column("Std. dev. (%)", decimals=2, interval=False, limits=(0, inf)),
            "deviation": Column("Of all (%)", decimals=2, interval=False, limits=(0, inf)),
            "difference": Column(f"{rival} (points)", limits=(-100, 100)),
            **{concept: Column(f"{concept.capitalize()} (%)", interval=False) for concept in CONCEPTS},
            "parameters": Column("Parameters (k)", decimals=0, interval=False, limits=(0, inf)),
        },
        footnotes=(
            f"{over_clusters(shown.seeds, shown.test_samples // shown.seeds, SCENES)}. Training sees none of these "
            f"scenes. Each seed has its own split of the scenes, perturbations, {encoder}, and GPC.",
            "Std. dev.: as the paper says, of classifiers on one encoder's embeddings, the first seed's. Of all: of "
            "the seeds of the accuracy.",
            f"{rival}: paired difference to it{other}. By concept: the share of its samples that is attributed to it. "
            "Parameters: of the encoder.",
            *([f"{', '.join(beside.values())}{fewer}: {PUBLISHED_NOTE}"] if beside else ()),
        ),
    )


def _cells(
    intervals: pd.DataFrame, metrics: pd.DataFrame, method: str, parameters: int | None = None
) -> dict[str, Cell | None]:
    """Return the cells of a method."""
    rows = rows_where(intervals, method=method)
    accuracy = clustered_cell(rows, metric="accuracy", concept=ALL)
    if accuracy is None:
        return {}
    cells: dict[str, Cell | None] = {"accuracy": accuracy}
    accuracy_R = _values(metrics, method)
    if len(accuracy_R) > 1:
        cells["deviation"] = plain_cell(float(accuracy_R.std(ddof=1)), accuracy.seeds, accuracy.test_samples)
    cells["difference"] = clustered_cell(rows, metric="difference")
    cells |= {concept: clustered_cell(rows, metric="accuracy", concept=concept) for concept in CONCEPTS}
    if parameters is not None:
        cells["parameters"] = plain_cell(parameters / 1000, accuracy.seeds, accuracy.test_samples)
    return cells


def _deviation(one_encoder: pd.DataFrame, method: str) -> Cell | None:
    accuracy_R = _values(one_encoder, method)
    return plain_cell(float(accuracy_R.std(ddof=1)), len(accuracy_R), 0) if len(accuracy_R) > 1 else None


def _values(metrics: pd.DataFrame, method: str) -> np.ndarray:
    """Return the accuracies over the seeds in %."""
    return rows_where(metrics, method=method, metric="accuracy", concept=ALL)["value"].to_numpy() * 100


@table(
    SECTION,
    "Depth frames: seen and unseen objects, datasets, real initial poses",
    """The rows of Table VI, split into objects that training saw and did not see, by dataset, and with initial poses
    of real estimators.""",
    name="table6_seen_unseen",
    **NUMBERS,
)
def table6_by_objects(run: Run, intervals: pd.DataFrame, metrics: pd.DataFrame) -> Table:
    """:func:`table6_seen_unseen` of a run."""
    frames = run.config["real_world"]
    poses = {REAL_WORLD: frames["initial_pose"]}
    poses |= {f"{REAL_WORLD}_{name}": entry for name, entry in conditions_of(run.config).items()}
    embedded = [*reduced_backbones(frames), *published_backbones(frames)]
    explainer_of = dict.fromkeys(embedded, "gpca") | {name: name for name in (*CLASSIC, *frames["explainers"])}
    return table6_seen_unseen(
        intervals,
        metrics,
        title_of_frames(run.config),
        {name: POSES.get(entry.get("form", ""), GLOBAL_POSE) for name, entry in poses.items()},
        embedded,
        titles(frames["explainers"]),
        {name: explainer_entry(explainer).sight for name, explainer in explainer_of.items()},
        (frames["virtual"] or {}).get("objects") == "all",
    )


def table6_seen_unseen(
    intervals: pd.DataFrame,
    metrics: pd.DataFrame,
    title: str,
    conditions: Mapping[str, str],
    backbones: Sequence[str],
    explainers: Mapping[str, str],
    sees: Mapping[str, str],
    rendered: bool = False,
) -> Table:
    """Return the accuracy on depth frames, for seen and unseen objects and by dataset, under every condition.

    Args:
        conditions: Source of each condition -> its title, in order.
        backbones: The names of the methods ``{backbone}-{reduction}``, in order.
        sees: What each method sees, in words.
        rendered: Whether the encoders learned from frames rendered of the models first.
    """
    titles = {name: encoder_title(*name.split("-")) for name in backbones} | CLASSIC | dict(explainers)
    datasets = sorted({name for name in intervals["table"] if name.startswith(DATASET)})
    heads = {"condition": "Initial poses", "method": "Method", "reads": "Reads"}
    table = TableBuilder("table6_seen_unseen", heads)
    for (source, method), labels in crossed(conditions, titles):
        accuracies, scores = (rows_where(rows, source=source, method=method) for rows in (intervals, metrics))
        cells = _cells_by_objects(accuracies, scores, datasets)
        table.add_row([*labels, (sees[method], sees[method])], cells)
    table.compare_down(EVERYTHING_SEEN, same=1)
    columns = {name: Column(head) for name, head in EVERYTHING_SEEN.items()}
    titles_of = {name: dataset_in_words(name.removeprefix(DATASET)) for name in datasets}
    columns |= {name: Column(f"{words} (%)", interval=False) for name, words in titles_of.items()}
    columns |= {"ece": Column("ECE, all (share)", decimals=2, interval=False, limits=(0.0, 1.0))}
    columns |= {"nll": Column("NLL, all (nats)", decimals=2, interval=False, limits=(0.0, inf))}
    columns |= {"icp_calls": Column("ICP calls", decimals=0, interval=False, limits=(0.0, inf))}
    seeds = table.most_seeds()
    pretrained = "The pretraining renders the models of both. " if rendered else ""
    first = rows_where(intervals, source=next(iter(conditions)), metric="accuracy", concept=ALL)
    shares = [_share(first, name) for name in (SEEN, UNSEEN)]
    return table.build(
        caption=f"Accuracy (%) on {title}: objects that training saw and did not see",
        column_head="samples",
        columns=columns,
        footnotes=(
            f"{over_clusters(seeds, clusters=SCENES)}. Shares of the test samples of all seeds together, as some seeds "
            "have more of a column than others. Bold: best for one kind of initial poses.",
            *_counts(table, columns, conditions),
            f"No scene is in both training and test. Seen objects ({shares[0]} of the test samples) are shown in a "
            f"scene of the training too, unseen ones ({shares[1]}) are not. {pretrained}Instances take turns, so that "
            "objects and datasets are as unequally frequent as in the frames.",
            "ECE: expected calibration error, NLL: mean negative log likelihood, both of all; means over the seeds. "
            "Reads: what a method sees of a registration. ICP calls: runs beyond the one that it explains.",
        ),
    )


def _cells_by_objects(
    accuracies: pd.DataFrame, scores: pd.DataFrame, datasets: Sequence[str]
) -> dict[str, Cell | None]:
    rows = rows_where(accuracies, metric="accuracy", concept=ALL)
    cells = {name: clustered_cell(rows, table=name) for name in (*EVERYTHING_SEEN, *datasets)}
    together = rows_where(scores, table=TOGETHER, concept=ALL)
    samples = int(rows_where(together, metric="test_samples")["value"].sum())
    return cells | {
        metric: cell_of_repeats(rows_where(together, metric=metric)["value"].to_numpy(), samples)
        for metric in NOT_SHARES  # no means over samples
    }


def _counts(table: TableBuilder, columns: Mapping[str, Column], conditions: Mapping[str, str]) -> list[str]:
    """Return how many samples of how many seeds the accuracies are over, by initial poses where these differ."""
    conditions_of: dict[str, list[str]] = {}
    for source, words in conditions.items():
        cells = {key: cell for (row, key), cell in table.cells.items() if table.labels[row][0][0] == source}
        counts = [
            f"{columns[key].title.removesuffix(' (%)')} {cells[key].test_samples} ({plural(cells[key].seeds, 'seed')})"
            for key in columns
            if key in cells and key not in NOT_SHARES
        ]
        if counts:
            conditions_of.setdefault(", ".join(counts), []).append(words)
    if len(conditions_of) < 2:
        return [f"Test samples: {counts}." for counts in conditions_of]
    return [f"Test samples, {' and '.join(words)}: {counts}." for counts, words in conditions_of.items()]


def _share(samples: pd.DataFrame, name: str) -> str:
    of_part, of_all = (rows_where(samples, table=table)["samples"].to_numpy(float) for table in (name, TOGETHER))
    return f"{100 * np.sum(of_part) / np.sum(of_all):.0f} %" if len(of_all) else "0 %"
