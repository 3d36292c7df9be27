"""From learning curves to numbers: of every source, setting, concept held out, strategy and seed, as one tidy table."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.active_learning.curves import read_curves
from gpca.evaluation.measures import source_method_seed, tidy

if TYPE_CHECKING:
    import pandas as pd

TABLE = "active_learning/"  # `table` of the tidy rows reads this and the setting
RANDOM = "random"  # the strategy that the others are compared with, seed by seed
# A count that ended with the budget where the share beside it is below 1: its mean is a lower bound then.
CENSORED_BY = {
    "labels_to_target": "reached",
    "epochs_to_target": "reached",
    "epochs_at_target": "reached",
    "delay": "recognised",
}
RECOGNIZED = 0.5  # share of a new concept's test samples named right, from which on it counts as recognized


def collect_curves(files: Iterable[str | Path], target: float) -> pd.DataFrame:
    """Return the tidy metrics of files named `…/{source}/{strategy}/seed{seed}.csv`; results/README.md lists them.

    Raises:
        InputError: no files, a name of another form, a file that :func:`read_curves` refuses.
    """
    curves = {source_method_seed(path): read_curves(path) for path in files}
    records = []
    for (source, strategy, seed), of_file in curves.items():
        baseline = curves.get((source, RANDOM, seed), {})
        for (setting, held_out), curve in of_file.items():
            values = stream_metrics(curve) if "arrived" in curve else pool_metrics(curve, target)
            at_random = baseline.get((setting, held_out))
            if at_random is not None and "area_under_curve" in values and strategy != RANDOM:
                of_random = pool_metrics(at_random, target)
                if values["labels"] == of_random["labels"]:  # or the areas are over other labels
                    values["area_gain"] = values["area_under_curve"] - of_random["area_under_curve"]
            key = (TABLE + setting, source, strategy)
            records += [(*key, metric, held_out, seed, float(value)) for metric, value in values.items()]
    return tidy(records, "active learning")


def pool_metrics(curve: pd.DataFrame, target: float) -> dict[str, float]:
    """Return the metrics of one learning curve; where the target is missed, labels and epochs are lower bounds.

    ``epochs_to_target`` are those of all retrainings, ``epochs_at_target`` those of the one that reached the target.
    """
    hits = (curve["accuracy"] >= target).to_numpy()
    last = int(hits.argmax()) if hits.any() else len(curve) - 1
    return {
        "labels_to_target": curve["labels"][last],
        "epochs_to_target": curve["epochs"][: last + 1].sum(),
        "epochs_at_target": curve["epochs"][last],
        "reached": float(hits.any()),
        "start_accuracy": curve["accuracy"].iloc[0],
        "final_accuracy": curve["accuracy"].iloc[-1],
        "final_accuracy_new": curve["accuracy_new"].iloc[-1],
        "area_under_curve": area_under_curve(curve),
        "labels": curve["labels"].iloc[-1],
    }


def area_under_curve(curve: pd.DataFrame) -> float:
    """Return the mean accuracy over the budget: the area under accuracy over labels (trapezoids), divided by L."""
    import numpy as np

    labels, accuracies = curve["labels"].to_numpy(), curve["accuracy"].to_numpy()
    return float(np.trapezoid(accuracies, labels) / labels[-1]) if labels[-1] else float(accuracies[0])


def stream_metrics(curve: pd.DataFrame) -> dict[str, float]:
    """Return the metrics of one stream.

    Its delay counts the arrivals from the first row with samples of the new concept to that in which at least
    `RECOGNIZED` of its test samples are named right; never recognized, it is that to the end, a lower bound.
    """
    hits = (curve["present"] == 1) & (curve["accuracy_new"] >= RECOGNIZED)
    first = int(hits.argmax()) if hits.any() else len(curve) - 1
    appeared = curve["arrived"][int((curve["present"] == 1).argmax())]
    return {
        "delay": curve["arrived"][first] - appeared,
        "recognised": float(hits.any()),
        "running_accuracy": curve["running"].iloc[-1],
        "final_accuracy": curve["accuracy"].iloc[-1],
        "final_accuracy_new": curve["accuracy_new"].iloc[-1],
        "labels": curve["labels"].iloc[-1],
        "new_labels": curve["new_labels"].iloc[-1],
    }
