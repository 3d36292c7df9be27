"""Makes the table of the encoder's inputs on depth frames: Table VI's first backbone, by the cloud before it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.metrics import ALL
from gpca.experiments.real_world.tables import encoder_title
from gpca.experiments.specification_curve.registry import FRAME_INPUT
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder, crossed, interval_over
from gpca.reporting.tables.cells import cell_of_repeats, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

INPUTS = {
    "aligned": "observed cloud, aligned by ICP",
    "observed": "observed cloud before ICP",
    "reversed": "observed cloud, ICP from the model to it",
}
OBJECTS = {"all": "All (%)", "seen": "Seen objects (%)", "unseen": "Unseen objects (%)"}
CONFUSED = {"pose": "overlap", "overlap": "pose"}


def table6_inputs(metrics: pd.DataFrame, title: str) -> Table:
    """Return the accuracy on depth frames by the cloud that the encoder sees.

    Args:
        metrics: The tidy rows of the readings ``frame_input``.
    """
    methods = {method: encoder_title(*method.split("-")) for method in metrics["method"].unique()}
    table = TableBuilder("table6_inputs", {"backbone": "Backbone", "input": "The encoder sees"})
    for (method, cloud), labels in crossed(methods, INPUTS):
        of = {name: rows_where(metrics, table=f"{FRAME_INPUT}/{cloud}/{name}", method=method) for name in OBJECTS}
        cells = {name: _share(rows) for name, rows in of.items()}
        cells |= {concept: _share(of["all"], concept=concept) for concept in CONCEPTS}
        cells |= {f"{one}_as_{other}": _taken(of["all"], one, other) for one, other in CONFUSED.items()}
        table.add_row(labels, cells)
    table.compare_down(OBJECTS, same=1)
    columns = {name: Column(head) for name, head in OBJECTS.items()}
    columns |= {concept: Column(f"{concept.capitalize()} (%)", interval=False) for concept in CONCEPTS}
    columns |= {
        f"{one}_as_{other}": Column(f"{one.capitalize()} taken for {other} (%)", interval=False)
        for one, other in CONFUSED.items()
    }
    of_first = {name: table.cells[0, name].test_samples for name in OBJECTS if (0, name) in table.cells}
    counts = ", ".join(f"{name} {count}" for name, count in of_first.items())
    seeds = table.most_seeds()
    return table.build(
        caption=f"Accuracy (%) on {title} by the cloud that the encoder sees",
        column_head="samples",
        columns=columns,
        footnotes=(
            f"Mean over {plural(seeds, 'seed')}, the first of the run; {interval_over(seeds)}. Test samples: {counts}. "
            "The share of seen objects differs from seed to seed, so that All need not lie between Seen and Unseen.",
            "Each cloud has an encoder of its own, pretrained and trained as that of the first row, which is Table "
            "VI's, on the same samples.",
        ),
    )


def _share(rows: pd.DataFrame, metric: str = "accuracy", concept: str = ALL) -> Cell | None:
    value_R = rows_where(rows, metric=metric, concept=concept).sort_values("seed")["value"].to_numpy()
    counted = rows_where(rows, metric="test_samples", concept=concept)["value"]
    return cell_of_repeats(100 * value_R, int(counted.sum()))


def _taken(rows: pd.DataFrame, one: str, other: str) -> Cell | None:
    taken_R, samples_R = (
        rows_where(rows, metric=metric, concept=one).sort_values("seed")["value"].to_numpy(float)
        for metric in (f"predicted_as_{other}", "test_samples")
    )
    return cell_of_repeats(100 * np.divide(taken_R, samples_R), int(samples_R.sum()))
