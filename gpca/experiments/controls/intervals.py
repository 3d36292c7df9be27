"""Intervals of accuracies under the controls, and of what they lose against the paper's protocol.

By the bootstrap over objects and seeds of :mod:`gpca.attribution.confidence`. A draw of objects and seeds is the same
for all explainers and controls of a source, so that differences are paired, also where a control has other samples.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.confidence import bounds, pigeonhole_weights
from gpca.experiments.controls.metrics import auroc_error, read_controls
from gpca.experiments.controls.settings import PAPER, TRANSFER, plain_of
from gpca.experiments.diagnosis.judged import POOLED
from gpca.io.csv_file import read_numbers
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = (
    *("control", "source", "trained_on", "method", "metric", "samples", "seeds", "value", "low", "high"),
    *("change", "change_low", "change_high"),
)


def collect(prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return accuracy and auroc_error of every control and explainer over all seeds, with 95 % intervals.

    By the source tested, and pooled over all. Of transfer there is a row for each source trained on, and one for all
    others together, whose ``trained_on`` is pooled. The change is the value minus the paper's protocol's, for the
    same seeds; of an explainer whose encoder is trained otherwise, minus its own with the paper's training, on the same
    samples.
    """
    import pandas as pd

    judged = read_controls(prediction_files)
    sources = list(dict.fromkeys(judged["source"]))
    records: list[tuple] = []
    for source in (*sources, POOLED) if len(sources) > 1 else sources:
        of_source = judged if source == POOLED else judged[judged["source"] == source]
        for explainer, rows in of_source.groupby("explainer", sort=False):
            weights_B_N = _weights(source, rows)
            groups = _groups(rows, source)
            compared, weights_of_compared = rows, weights_B_N
            if plain := plain_of(str(explainer)):
                compared = of_source[(of_source["explainer"] == plain) & of_source["seed"].isin(rows["seed"])]
                weights_of_compared = _weights(source, compared)
            for (control, trained_on), mask in groups.items():
                own = _measures(rows[mask], weights_B_N[:, mask])
                other = (compared["control"] == (control if plain else PAPER)) & compared["seed"].isin(
                    rows["seed"][mask]
                )
                against, _ = _measures(compared[other], weights_of_compared[:, other.to_numpy()])
                records += _records(source, str(explainer), (control, trained_on), own, against)
    return pd.DataFrame(records, columns=list(COLUMNS))


def read_intervals(path: str | Path) -> pd.DataFrame:
    """Read what :func:`collect` returned; where nothing is wrong, auroc_error has no row, and some bounds are NaN.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a value that is no finite number.
    """
    return read_numbers(path, COLUMNS, COLUMNS[5:], optional=COLUMNS[8:])


Measured = tuple[dict[str, np.ndarray], tuple[int, int]]  # values by metric; numbers of samples and seeds
Group = tuple[str, str]  # control, trained on


def _weights(source: str, rows: pd.DataFrame) -> np.ndarray:
    """Return the weights (B, N) of the samples as they are, and then of every draw."""
    factors = (rows["seed"].to_numpy(), rows["instance"].to_numpy(str))
    drawn_B_N = pigeonhole_weights(generator("control intervals", source), *factors)
    return np.vstack([np.ones(len(rows)), drawn_B_N])


def _records(
    source: str, explainer: str, group: Group, measured: Measured, against: Mapping[str, np.ndarray]
) -> Iterator[tuple]:
    (control, trained_on), (values, counts) = group, measured
    for metric, value_B in values.items():
        if np.isfinite(value_B[0]):
            change_B = value_B - against[metric]
            own = (control, source, trained_on, explainer, metric, *counts)
            yield (*own, value_B[0], *bounds(value_B[1:]), change_B[0], *bounds(change_B[1:]))


def _groups(rows: pd.DataFrame, source: str) -> dict[Group, np.ndarray]:
    """Return (control, trained on) -> which rows are of it."""
    control, trained_on = rows["control"].to_numpy(str), rows["trained_on"].to_numpy(str)
    groups = {}
    for name in dict.fromkeys(control.tolist()):
        of_control = control == name
        if name == TRANSFER and source != POOLED:
            for other in dict.fromkeys(trained_on[of_control].tolist()):
                groups[name, other] = of_control & (trained_on == other)
        groups[name, POOLED if name == TRANSFER else source] = of_control
    return groups


def _measures(rows: pd.DataFrame, weights_B_N: np.ndarray) -> Measured:
    right_N = rows["right"].to_numpy()
    with np.errstate(divide="ignore", invalid="ignore"):
        accuracy_B = (weights_B_N * right_N).sum(axis=1) / weights_B_N.sum(axis=1)
    measures = {"accuracy": accuracy_B, "auroc_error": auroc_error(rows, "entropy", weights_B_N)}
    return measures, (len(rows), rows["seed"].nunique())
