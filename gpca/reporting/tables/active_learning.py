"""The tables of active learning, from the tidy metrics of :func:`gpca.active_learning.metrics.collect_curves`.

All take the same arguments and raise the same error:

    metrics: tidy.
    sources: name -> ``{"title": str, "stand_in": bool}``, in the order of the rows.
    strategies: name -> title, in the order in which they are shown.
    conditions: the config's section ``active_learning``, and ``train`` and ``test`` of its ``registrations``.
    InputError: the metrics hold none of these sources and strategies.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING, Any

from gpca.active_learning.acquisition import STRATEGIES, STREAMS
from gpca.active_learning.metrics import CENSORED_BY, TABLE
from gpca.attribution.metrics import mean_interval
from gpca.errors import InputError
from gpca.objects.title import STAND_IN, title_of
from gpca.reporting.tables.table import Cell, Cells, Column, Rows, Table

if TYPE_CHECKING:
    import pandas as pd

PAPERS_HELD_OUT = "overlap"  # a GPC that knows noise and pose (Sec. IV-C)
SETTINGS = {  # name -> title
    "pretrained": "all concepts",
    "unseen": "the known concepts only",
    "rare": "all concepts; the new one rare",
}
_COUNT: dict[str, Any] = {"decimals": 0, "limits": (0, inf), "least_is_best": True}


@dataclass(frozen=True)
class Quantity:
    """What a column shows: a metric of all rows, or of one strategy or one concept held out."""

    metric: str
    column: Column
    strategy: str | None = None
    concept: str | None = None


def table3_active_learning(
    metrics: pd.DataFrame, sources: Mapping[str, Mapping], strategies: Mapping[str, str], conditions: Mapping
) -> Table:
    """Labels to the target accuracy, by BALD with k-means and at random (paper, Table III): sources × settings."""
    of_table = metrics[metrics["concept"] == PAPERS_HELD_OUT]
    quantities = {
        "labels_bald_kmeans": Quantity(
            "labels_to_target", Column("Labels, BALD + k-means", **_COUNT), strategy="bald_kmeans"
        ),
        "labels_random": Quantity("labels_to_target", Column("Labels, random", **_COUNT), strategy="random"),
        "accuracy_bald_kmeans": Quantity("final_accuracy", Column("Acc. BALD (%)"), strategy="bald_kmeans"),
        "accuracy_random": Quantity("final_accuracy", Column("Acc. random (%)"), strategy="random"),
        "epochs_bald_kmeans": Quantity("epochs_to_target", Column("Epochs", **_COUNT), strategy="bald_kmeans"),
    }
    labelled = [
        (((source, title_of(entry)), (setting, title)), _select(of_table, source, setting))
        for source, entry in sources.items()
        for setting, title in SETTINGS.items()
    ]
    rows, cells = _filled(labelled, quantities)
    return _table(
        sources,
        conditions,
        name="table3_active_learning",
        caption=f"Labels until a GPC that knew noise and pose reaches {conditions['target']:.0%} on all concepts",
        row_heads={"source": "Dataset", "setting": "Encoder saw"},
        rows=rows,
        columns={key: quantity.column for key, quantity in quantities.items()},
        cells=cells,
        compared=tuple([(row, key) for key in ("labels_bald_kmeans", "labels_random")] for row in range(len(rows))),
        notes=(
            _protocol(conditions),
            f"Rare: {conditions['rare_share']:.0%} of the pool are of the new concept, and {conditions['rare_labels']} "
            "labels may be asked for.",
            f"Retraining is a warm start of at most {conditions['iterations']} passes over the labels. Epochs: passes "
            "until the target, over all rounds. Acc.: after all labels.",
        ),
    )


def table3_extended(
    metrics: pd.DataFrame, sources: Mapping[str, Mapping], strategies: Mapping[str, str], conditions: Mapping
) -> Table:
    """Every strategy, encoder and concept held out; means over the three where one column stands for all."""
    quantities = {
        f"labels_{c}": Quantity("labels_to_target", Column(f"Labels, {c}", **_COUNT), concept=c)
        for c in _concepts(metrics)
    } | {
        "reached": Quantity("reached", Column("Reached (%)", decimals=0, interval=False)),
        "final_accuracy": Quantity("final_accuracy", Column("Accuracy (%)")),
        "final_accuracy_new": Quantity("final_accuracy_new", Column("New (%)")),
        "area_under_curve": Quantity("area_under_curve", Column("Area (%)")),
        "area_gain": Quantity("area_gain", Column("Gain (%)", limits=(-100, 100))),
    }
    labelled = [
        (
            ((source, title_of(entry)), (setting, SETTINGS[setting]), (strategy, title)),
            _select(metrics, source, setting, strategy),
        )
        for source, entry in sources.items()
        for setting in ("pretrained", "unseen")
        for strategy, title in strategies.items()
        if strategy in STRATEGIES
    ]
    rows, cells = _filled(labelled, quantities)
    rivals = {key: quantity for key, quantity in quantities.items() if key != "reached"}
    return _table(
        sources,
        conditions,
        name="table3_extended",
        caption=f"Active learning of a held-out concept by every strategy, to {conditions['target']:.0%}",
        row_heads={"source": "Dataset", "setting": "Encoder saw", "strategy": "Strategy"},
        rows=rows,
        columns={key: quantity.column for key, quantity in quantities.items()},
        cells=cells,
        compared=_within(rows, rivals, 2),
        notes=(
            _protocol(conditions),
            "Labels: until the target, by the concept held out. Reached: share of the runs that reached it. Accuracy: "
            "after all labels; New: that on the concept held out. Area: mean accuracy over the budget. Gain: area "
            "minus that of random drawing from the same start, paired by seed. All but Labels are means over the "
            "concepts held out, then over the seeds.",
        ),
    )


def table3_stream(
    metrics: pd.DataFrame, sources: Mapping[str, Mapping], strategies: Mapping[str, str], conditions: Mapping
) -> Table:
    """The stream form: labels asked for, arrivals until a new concept is recognised, accuracy."""
    stream = conditions["stream"]
    quantities = {
        f"delay_{c}": Quantity("delay", Column(f"Delay, {c}", **_COUNT), concept=c) for c in _concepts(metrics)
    } | {
        "labels": Quantity("labels", Column("Labels", interval=False, **_COUNT)),
        "new_labels": Quantity("new_labels", Column("of the new", interval=False, **_COUNT)),
        "running_accuracy": Quantity("running_accuracy", Column("Running (%)")),
        "final_accuracy": Quantity("final_accuracy", Column("Accuracy (%)")),
        "final_accuracy_new": Quantity("final_accuracy_new", Column("New (%)")),
    }
    labelled = [
        (((source, title_of(entry)), (strategy, title)), _select(metrics, source, "pretrained", strategy))
        for source, entry in sources.items()
        for strategy, title in strategies.items()
        if strategy in STREAMS
    ]
    rows, cells = _filled(labelled, quantities)
    return _table(
        sources,
        conditions,
        name="table3_stream",
        caption="A new concept in a stream of registrations",
        row_heads={"source": "Dataset", "strategy": "Strategy"},
        rows=rows,
        columns={key: quantity.column for key, quantity in quantities.items()},
        cells=cells,
        compared=_within(rows, {key: quantity for key, quantity in quantities.items() if "labels" not in key}, 1),
        notes=(
            f"{stream['arrivals']} samples arrive one by one; the first {stream['quiet']} are of the two known "
            f"concepts ({conditions['initial']} labelled samples at the start), of the others a third is new. A label "
            f"may be asked for at {stream['budget']:.0%} of the arrivals; the GPC learns at once.",
            "Delay: arrivals from the first sample of the new concept until half of its test samples are named right; "
            "'>': some runs ended before. Running: accuracy over the last arrivals, each judged before its label is "
            "known. Accuracy, New: on all test samples and those of the new concept, at the end. All but Delay are "
            "means over the concepts held out, then over the seeds.",
        ),
    )


LEARNING_TABLES = {table.__name__: table for table in (table3_active_learning, table3_extended, table3_stream)}

_SHARES = ("reached", "area_under_curve", "area_gain")  # and every accuracy: in [0, 1], printed in %


def _concepts(metrics: pd.DataFrame) -> list[str]:
    return list(dict.fromkeys(metrics["concept"]))


def _select(metrics: pd.DataFrame, source: str, setting: str, strategy: str | None = None) -> pd.DataFrame:
    rows = metrics[(metrics["source"] == source) & (metrics["table"] == TABLE + setting)]
    return rows if strategy is None else rows[rows["method"] == strategy]


def _filled(labelled: Iterable[tuple[tuple, pd.DataFrame]], quantities: Mapping[str, Quantity]) -> tuple[tuple, dict]:
    """Return the labels of the rows that have any cell, and the cells."""
    rows: Rows = []
    cells: Cells = {}
    for labels, metrics in labelled:
        found = {key: cell for key, quantity in quantities.items() if (cell := _cell(metrics, quantity))}
        cells |= {(len(rows), key): cell for key, cell in found.items()}
        rows += [labels] if found else []
    return tuple(rows), cells


def _cell(metrics: pd.DataFrame, quantity: Quantity) -> Cell | None:
    """Make a cell: mean over the concepts held out that the rows hold, then over the seeds."""
    for column, wanted in (("method", quantity.strategy), ("concept", quantity.concept)):
        if wanted is not None:
            metrics = metrics[metrics[column] == wanted]
    values_R = metrics[metrics["metric"] == quantity.metric].groupby("seed")["value"].mean()
    if values_R.empty:
        return None
    scale = 100 if quantity.metric in _SHARES or "accuracy" in quantity.metric else 1
    mean, low, _ = mean_interval(values_R * scale)
    done = metrics.loc[metrics["metric"] == CENSORED_BY.get(quantity.metric), "value"]
    return Cell(mean, mean - low, len(values_R), 0, at_least=bool((done < 1).any()))


def _within(rows: tuple, quantities: Mapping[str, Quantity], labels: int) -> tuple[list, ...]:
    """Return the groups of cells to be compared: of one quantity, in the rows whose first labels agree, no oracles."""
    groups: dict[tuple, list] = {}
    for number, row in enumerate(rows):
        if row[-1][0] in STRATEGIES and STRATEGIES[row[-1][0]].oracle:
            continue
        for key in quantities:
            groups.setdefault((row[:labels], key), []).append((number, key))
    return tuple(groups.values())


def _table(sources, conditions: Mapping, *, caption: str, notes: tuple[str, ...], rows, cells, **fields) -> Table:
    if not cells:
        raise InputError("metrics", f"hold nothing for {fields['name']}", "run its strategies first")
    if any(sources[labels[0][0]]["stand_in"] for labels in rows):
        caption += f", on {STAND_IN}s of the datasets' objects"
    seeds = max(cell.seeds for cell in cells.values())
    repeats = (
        f"Mean over {seeds} seed{'s' * (seeds != 1)}, {conditions['test']} test samples each; ± is the half-width of "
        "the 95 % t-interval over the seeds."
    )
    counted = {key: replace(cell, test_samples=cell.seeds * conditions["test"]) for key, cell in cells.items()}
    return Table(
        caption=caption, rows=rows, cells=counted, column_head="quantity", footnotes=(repeats, *notes), **fields
    )


def _protocol(conditions: Mapping) -> str:
    return (
        f"Start: {conditions['initial']} labelled samples of the two known concepts. Pool: the other "
        f"{conditions['train'] - conditions['initial']} training samples, with all of the new concept, a third of "
        f"{conditions['train']}. "
        f"{conditions['batch']} labels a round, {conditions['labels']} in all; '>': some runs did not reach the target "
        "and count with all labels. Every strategy gets the same start, pool, test samples and retraining."
    )
