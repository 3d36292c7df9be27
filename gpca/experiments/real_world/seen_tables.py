"""Makes Table VI once more: GP-CA on depth frames, objects that training saw apart from those that it did not see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.metrics import ALL
from gpca.experiments.real_world.metrics import DATASET, SEEN, TOGETHER, UNSEEN
from gpca.experiments.real_world.tables import CLASSIC, encoder_title
from gpca.reporting.tables.builder import TableBuilder, crossed, interval_over
from gpca.reporting.tables.cells import cell_of_all_samples, cell_of_repeats, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import dataset_in_words, plural

if TYPE_CHECKING:
    import pandas as pd

EVERYTHING_SEEN = {TOGETHER: "All (%)", SEEN: "Seen objects (%)", UNSEEN: "Unseen objects (%)"}


def table6_seen_unseen(
    metrics: pd.DataFrame,
    title: str,
    conditions: Mapping[str, str],
    backbones: Sequence[str],
    explainers: Mapping[str, str],
    rendered: bool = False,
) -> Table:
    """Return the accuracy on depth frames, for seen and unseen objects and by dataset, under every condition.

    Args:
        metrics: The tidy metrics (:func:`gpca.experiments.real_world.metrics.collect`).
        conditions: Source of each condition -> its title, in order.
        backbones: The names of the methods ``{backbone}-{reduction}``, in order.
        rendered: Whether the encoders learned from frames rendered of the models first.
    """
    titles = {name: encoder_title(*name.split("-")) for name in backbones} | CLASSIC | dict(explainers)
    datasets = sorted({name for name in metrics["table"] if name.startswith(DATASET)})
    table = TableBuilder("table6_seen_unseen", {"condition": "Initial poses", "method": "Method"})
    for (source, method), labels in crossed(conditions, titles):
        table.add_row(labels, _cells(rows_where(metrics, source=source, method=method), datasets))
    table.compare_down(EVERYTHING_SEEN, same=1)
    columns = {name: Column(head) for name, head in EVERYTHING_SEEN.items()}
    titles_of = {name: dataset_in_words(name.removeprefix(DATASET)) for name in datasets}
    columns |= {name: Column(f"{words} (%)", interval=False) for name, words in titles_of.items()}
    columns |= {"ece": Column("ECE, all (share)", decimals=2, interval=False, limits=(0.0, 1.0))}
    columns |= {"nll": Column("NLL, all (nats)", decimals=2, interval=False, limits=(0.0, inf))}
    seeds = table.most_seeds()
    pretrained = "The pretraining renders the models of both. " if rendered else ""
    first = rows_where(metrics, source=next(iter(conditions)), metric="test_samples", concept=ALL)
    shares = [_share(first, name) for name in (SEEN, UNSEEN)]
    return table.build(
        caption=f"Accuracy (%) on {title}: objects that training saw and did not see",
        column_head="samples",
        columns=columns,
        footnotes=(
            f"Mean over the test samples of {plural(seeds, 'seed')} together, as some seeds have more of a column than "
            f"others; {interval_over(seeds)}. Bold: best for one kind of initial poses.",
            *_counts(table, columns, conditions),
            f"No scene is in both training and test. Seen objects ({shares[0]} of the test samples) are shown in a "
            f"scene of the training too, unseen ones ({shares[1]}) are not. {pretrained}Instances take turns, so that "
            "objects and datasets are as unequally frequent as in the frames.",
            "ECE: expected calibration error, NLL: mean negative log likelihood, both of all; means over the seeds.",
        ),
    )


def _cells(of_method: pd.DataFrame, datasets: Sequence[str]) -> dict[str, Cell | None]:
    cells = {name: _cell(rows_where(of_method, table=name), "accuracy") for name in (*EVERYTHING_SEEN, *datasets)}
    together = rows_where(of_method, table=TOGETHER)
    return cells | {metric: _cell(together, metric, scale=1) for metric in ("ece", "nll")}


def _cell(rows: pd.DataFrame, metric: str, scale: float = 100) -> Cell | None:
    value_R, samples_R = (
        rows_where(rows, metric=name, concept=ALL).sort_values("seed")["value"].to_numpy(float)
        for name in (metric, "test_samples")
    )
    if metric == "accuracy":
        return cell_of_all_samples(scale * value_R, samples_R)
    return cell_of_repeats(scale * value_R, int(samples_R.sum()))  # no mean over samples


def _counts(table: TableBuilder, columns: Mapping[str, Column], conditions: Mapping[str, str]) -> list[str]:
    """Return how many samples of how many seeds the accuracies are over, by initial poses where these differ."""
    conditions_of: dict[str, list[str]] = {}
    for source, words in conditions.items():
        cells = {key: cell for (row, key), cell in table.cells.items() if table.rows[row][0][0] == source}
        counts = [
            f"{columns[key].title.removesuffix(' (%)')} {cells[key].test_samples} ({plural(cells[key].seeds, 'seed')})"
            for key in columns
            if key in cells and key not in ("ece", "nll")
        ]
        if counts:
            conditions_of.setdefault(", ".join(counts), []).append(words)
    if len(conditions_of) < 2:
        return [f"Test samples: {counts}." for counts in conditions_of]
    return [f"Test samples, {' and '.join(words)}: {counts}." for counts, words in conditions_of.items()]


def _share(samples: pd.DataFrame, name: str) -> str:
    of_part, of_all = (rows_where(samples, table=table)["value"].to_numpy(float) for table in (name, TOGETHER))
    return f"{100 * np.sum(of_part) / np.sum(of_all):.0f} %" if len(of_all) else "0 %"
