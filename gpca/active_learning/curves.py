"""Learning curves of active learning: their files, with a row per round or per some arrivals, and their metrics."""

from collections.abc import Iterable
from pathlib import Path

from gpca.evaluation.measures import source_method_seed, tidy
from gpca.io.csv_file import numbers, read_csv, write_csv
from gpca.io.frame import Frame

_ACCURACIES = ("accuracy", "accuracy_new")
POOL_COLUMNS = ("setting", "held_out", "labels", "new_labels", *_ACCURACIES, "epochs")
STREAM_COLUMNS = ("setting", "held_out", "arrived", "present", "labels", "new_labels", "running", *_ACCURACIES)
_SHARED = ("setting", "held_out", "labels", *_ACCURACIES)
TABLE = "active_learning/"  # prefix of the setting in the column `table` of the tidy rows
RANDOM = "random"  # strategy with which the others are compared, seed by seed
# Counts that are lower bounds if this share is below 1: they end with the budget.
CENSORED_BY = dict.fromkeys(("labels_to_target", "epochs_to_target", "epochs_at_target"), "reached")
CENSORED_BY["delay"] = "recognised"
RECOGNIZED = 0.5  # accuracy on a new concept's test samples from which it counts as recognized


def write_curves(
    path: str | Path, curves: dict[tuple[str, str], list[dict[str, float]]], columns: Iterable[str]
) -> None:
    import pandas as pd

    parts = [pd.DataFrame(steps).assign(setting=key[0], held_out=key[1]) for key, steps in curves.items()]
    write_csv(path, pd.concat(parts)[list(columns)])


def read_curves(path: str | Path) -> dict[tuple[str, str], Frame]:
    rows = read_csv(path, _SHARED, others=(*POOL_COLUMNS, *STREAM_COLUMNS))
    for column in rows.columns[2:]:
        # Empty are the running accuracy before the first arrival, and accuracies without test samples.
        rows[column] = numbers(path, rows, column, rows[column] != "")
    return {key: part.reset_index(drop=True) for key, part in rows.groupby(["setting", "held_out"], sort=False)}


def collect_curves(files: Iterable[str | Path], target: float) -> Frame:
    """Return the tidy metrics of files named `…/{source}/{strategy}/seed{seed}.csv`; results/README.md lists them."""
    curves = {source_method_seed(path): read_curves(path) for path in files}
    records = []
    for (source, strategy, seed), by_setting in curves.items():
        baseline = curves.get((source, RANDOM, seed), {})
        for (setting, held_out), curve in by_setting.items():
            values = stream_metrics(curve) if "arrived" in curve else pool_metrics(curve, target)
            at_random = baseline.get((setting, held_out))
            if at_random is not None and "area_under_curve" in values and strategy != RANDOM:
                random_values = pool_metrics(at_random, target)
                if values["labels"] == random_values["labels"]:  # or the areas cover different numbers of labels
                    values["area_gain"] = values["area_under_curve"] - random_values["area_under_curve"]
            key = (TABLE + setting, source, strategy)
            records += [(*key, metric, held_out, seed, float(value)) for metric, value in values.items()]
    return tidy(records, "active learning")


def pool_metrics(curve: Frame, target: float) -> dict[str, float]:
    """Return the metrics of one learning curve; labels and epochs are lower bounds if the target is missed.

    ``epochs_to_target`` sums all retrainings, ``epochs_at_target`` is that of the one that reached the target.
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


def area_under_curve(curve: Frame) -> float:
    """Return the area under accuracy over labels (trapezoids), divided by the number of labels."""
    import numpy as np

    labels, accuracies = curve["labels"].to_numpy(), curve["accuracy"].to_numpy()
    return float(np.trapezoid(accuracies, labels) / labels[-1]) if labels[-1] else float(accuracies[0])


def stream_metrics(curve: Frame) -> dict[str, float]:
    """Return the metrics of one stream.

    The delay is from the first row with samples of the new concept until its accuracy reaches `RECOGNIZED`, or the end.
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
