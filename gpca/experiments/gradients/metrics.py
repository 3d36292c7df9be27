"""Turns deleted points and TCAV's tests into one tidy table of metrics."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.evaluation.measures import ALL, source_method_seed, tidy
from gpca.io.csv_file import numbers, read_csv

if TYPE_CHECKING:
    import pandas as pd

SALIENCY, TCAV = "saliency", "tcav"  # the column `table`
RANDOM = "random"  # the order that the others are compared with
DELETION_COLUMNS = ("sample", "concept", "named", "order", "deleted", "before", "after", "changed")
TCAV_VALUES = ("score", "chance", "p", "significant", "probe")


def collect(deletion_files: Iterable[str | Path], tcav_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return tidy metrics of files named `…/{source}/seed{seed}.csv`; results/README.md lists them.

    Raises:
        InputError: no files, one that is missing or damaged.
    """
    records: list[tuple] = []
    for path in deletion_files:
        _, source, seed = source_method_seed(path)
        rows = read_csv(path, DELETION_COLUMNS)
        for column in ("deleted", "before", "after", "changed"):
            rows[column] = numbers(path, rows, column)
        rows["drop"] = rows["before"] - rows["after"]
        means = rows.groupby(["order", "deleted"], sort=False)[["drop", "changed"]].mean()
        for (order, deleted), row in means.iterrows():
            key = (SALIENCY, source, order)
            means_of_order = {"drop": row["drop"], "changed": row["changed"]}
            if order != RANDOM and (RANDOM, deleted) in means.index:
                means_of_order["excess"] = row["drop"] - means.loc[(RANDOM, deleted), "drop"]
            records += [(*key, f"{name}_{percent(deleted)}", ALL, seed, float(v)) for name, v in means_of_order.items()]
        records += [
            (SALIENCY, source, order, "test_samples", ALL, seed, float(part["sample"].nunique()))
            for order, part in rows.groupby("order", sort=False)
        ]
    for path in tcav_files:
        _, source, seed = source_method_seed(path)
        rows = read_csv(path, ("tested", "concept", *TCAV_VALUES))
        for value in TCAV_VALUES:
            rows[value] = numbers(path, rows, value)
        records += [
            (TCAV, source, row["tested"], value, row["concept"], seed, float(row[value]))
            for _, row in rows.iterrows()
            for value in TCAV_VALUES
        ]
    return tidy(records, "gradients")


def percent(share: float) -> str:
    """Return a share as part of a metric's name: 0.25 is `25`."""
    return f"{100 * share:g}"
