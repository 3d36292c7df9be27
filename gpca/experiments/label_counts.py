"""Numbers of labels and accuracies of learning curves as cells of tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from gpca.active_learning.curves import CENSORED_BY
from gpca.causes.dataset import Causes
from gpca.declarations.result import Frame, Paths
from gpca.pairs.dataset import Registrations
from gpca.reporting.sheet import Show
from gpca.reporting.tables.cells import cautious_cell, cell_of_repeats, where
from gpca.reporting.tables.table import Cell
from gpca.seeds import seed_of_file

COUNT: dict[str, Any] = {"decimals": 0, "limits": (0, inf), "least_is_best": True, "factor": 1}
OVER_TEST_SAMPLES = ("final_accuracy", "final_accuracy_new", "area_under_curve")
Clusters = Mapping[tuple[str, int], int]  # (source, seed) -> number of families of the test samples


def families(files: Paths, load: Callable[[Path, tuple[str, int]], Registrations] = Registrations.load) -> Clusters:
    """Number of families of the test samples in files named ``…/{source}/seed{seed}.npz``."""
    counts = {}
    for path in map(Path, files):
        axes = path.parent.name, seed_of_file(path)
        registrations = load(path, axes)
        counts[axes] = len(np.unique(registrations.cluster[registrations.rows("test")]))
    return counts


def families_with_causes(files: Paths) -> Clusters:
    """Number of families of the test samples of registrations with measured causes."""
    return families(files, lambda path, axes: Causes.load(path, axes).registrations)


def quantity(metric: str, title: str, method: str = "", concept: str = "", **options: Any) -> Show:
    """Column of a metric of all rows, or of one strategy or one concept held out."""
    wanted = {"metric": metric, "method": method, "concept": concept}
    return Show(title, where={key: name for key, name in wanted.items() if name}, **options)


def label_cells(test: int, clusters: Clusters) -> Callable[[Frame, Show], Cell | None]:
    """How cells are made: means over the concepts held out that the rows have, then over the seeds.

    Args:
        test: number of test samples of a seed.
        clusters: numbers of clusters of these, which widen the interval of an accuracy, if there are any.
    """

    def cell(rows: Frame, column: Show) -> Cell | None:
        metric, chosen = column.where["metric"], where(rows, column.where)
        values_R = column.factor * chosen.groupby("seed")["value"].mean()
        if clusters and metric in OVER_TEST_SAMPLES:
            counted = sum(
                clusters[source, int(seed)] for source in chosen["source"].unique() for seed in values_R.index
            )
            return cautious_cell(values_R, test * len(values_R), counted)
        done = where(rows, {**column.where, "metric": CENSORED_BY.get(metric)})["value"]
        return cell_of_repeats(values_R, test * len(values_R), at_least=bool((done < 1).any()))

    return cell
