"""Numbers of labels and accuracies of learning curves as cells of tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from gpca.active_learning.curves import CENSORED_BY
from gpca.causes.dataset import Causes
from gpca.declarations.result import Frame, Paths
from gpca.pairs.dataset import Registrations
from gpca.reporting.tables.cells import cautious_cell, cell_of_repeats, rows_where
from gpca.reporting.tables.table import Cell, Column
from gpca.seeds import seed_of_file

COUNT: dict[str, Any] = {"decimals": 0, "limits": (0, inf), "least_is_best": True}
SHARES = ("reached", "area_under_curve", "area_gain")  # these and every accuracy lie in [0, 1] and are printed in %
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


@dataclass(frozen=True)
class Quantity:
    """A column: a metric of all rows, or of one strategy or one concept held out."""

    metric: str
    column: Column
    strategy: str | None = None
    concept: str | None = None


def cell_of(metrics: Frame, quantity: Quantity, test: int, clusters: Clusters | None = None) -> Cell | None:
    """Mean of a quantity over the concepts held out that the rows have, then over the seeds.

    Args:
        metrics: of one source.
        test: number of its test samples of a seed.
        clusters: numbers of clusters of these, which widen the interval of an accuracy.
    """
    if quantity.strategy is not None:
        metrics = rows_where(metrics, method=quantity.strategy)
    if quantity.concept is not None:
        metrics = rows_where(metrics, concept=quantity.concept)
    rows = rows_where(metrics, metric=quantity.metric)
    values_R = rows.groupby("seed")["value"].mean()
    scale = 100 if quantity.metric in SHARES or "accuracy" in quantity.metric else 1
    samples = test * len(values_R)
    if clusters is not None and quantity.metric in OVER_TEST_SAMPLES:
        counted = sum(clusters[source, int(seed)] for source in rows["source"].unique() for seed in values_R.index)
        return cautious_cell(values_R * scale, samples, counted)
    done = rows_where(metrics, metric=CENSORED_BY.get(quantity.metric))["value"]
    return cell_of_repeats(values_R * scale, samples, at_least=bool((done < 1).any()))
