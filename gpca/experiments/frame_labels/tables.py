"""Makes the table of active learning on depth frames: labels to each target, by the embedding of the samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from gpca.active_learning.curves import TABLE
from gpca.active_learning.settings import ALL_LABELS
from gpca.experiments.active_learning.tables import COUNT, Quantity, cell_of
from gpca.experiments.frame_labels.settings import PAIR, in_percent
from gpca.frames.source import REAL_WORLD
from gpca.reporting.tables.builder import TableBuilder, mean_over
from gpca.reporting.tables.cells import rows_where
from gpca.reporting.tables.table import Cell, Column, Table

if TYPE_CHECKING:
    import pandas as pd

STRATEGIES = {"bald_kmeans": "BALD, to {} % (labels)", "random": "Random, to {} % (labels)"}


def table6_labels(metrics: pd.DataFrame, title: str, encoders: Mapping[str, str], conditions: Mapping) -> Table:
    """Return the labels that BALD and random choice need on depth frames, for some backbones and for the pair.

    Args:
        metrics: The tidy metrics (:func:`gpca.experiments.frame_labels.metrics.collect`).
        encoders: The title of each backbone, in order.
        conditions: The config's sections ``active_learning`` and ``frame_labels``, and ``train`` and ``test`` of its
            ``real_world``.
    """
    metrics = rows_where(metrics, source=REAL_WORLD)
    percents = [in_percent(target) for target in conditions["targets"]]
    labels = {
        f"{strategy}_{percent}": (
            percent,
            Quantity("labels_to_target", Column(head.format(percent), **COUNT), strategy),
        )
        for percent in percents
        for strategy, head in STRATEGIES.items()
    }
    ends = {
        "start": Quantity("start_accuracy", Column("Start (%)", interval=False), "random"),
        "final": Quantity("final_accuracy", Column("BALD, all queries (%)"), "bald_kmeans"),
        "all_labels": Quantity("final_accuracy", Column("All labels (%)"), ALL_LABELS),
    }
    table = TableBuilder("table6_labels", {"seen": "Seen by"})
    for name, words in {**encoders, PAIR: "Measurements of the pair"}.items():
        cells: dict[str, Cell | None] = {}
        for key, (percent, quantity) in labels.items():
            of_target = rows_where(metrics, table=f"{TABLE}{name}/{percent}")
            cells[key] = cell_of(of_target, quantity, conditions["test"])
        of_curve = rows_where(metrics, table=TABLE + name)
        cells |= {key: cell_of(of_curve, quantity, conditions["test"]) for key, quantity in ends.items()}
        table.add_row([(name, words)], cells)
    for percent in percents:
        table.compare_across([f"{strategy}_{percent}" for strategy in STRATEGIES])
    columns = {key: quantity.column for key, (_, quantity) in labels.items()}
    columns |= {key: quantity.column for key, quantity in ends.items()}
    table.require_rows()
    return table.build(
        caption=f"Labels until a GPC to which {' or '.join(conditions['held_out'])} is new is as accurate on {title}",
        column_head="quantity",
        columns=columns,
        footnotes=(
            f"{mean_over(table.most_seeds(), conditions['test'])}. Bold: the fewer labels of the two to a target, "
            "whether or not their intervals overlap; neither where they are equal.",
            f"Start: {conditions['initial']} labeled samples of the two known concepts. Pool: the other training "
            f"samples of these, {conditions['train']} with those of the new one, of which so many stay that they are "
            f"{100 * conditions['share']:g} % of it. The paper's classifier is fitted anew in each round, as in Table "
            f"III, until all targets are reached, to {conditions['least']} labels at least and {conditions['labels']} "
            "at most; '>': some runs did not reach the target. Encoders saw every concept.",
            "All labels: of a classifier that learns the whole pool. DGCNN's row is compared with the paper's numbers.",
        ),
    )
