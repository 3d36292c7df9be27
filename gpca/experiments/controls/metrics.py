"""Turns the explainers' predictions under the controls into tidy metrics, and into intervals of these.

Intervals are by the bootstrap over objects and seeds of :mod:`gpca.evaluation.intervals`. A draw of objects and seeds
is the same for all explainers and controls of a source, so that differences are paired, also where a control has other
samples.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.judged import ranking
from gpca.errors import InputError
from gpca.evaluation.intervals import Difference, from_rival, from_untrained, interval, pigeonhole_weights
from gpca.evaluation.measures import ALL, POOLED, source_method_seed, tidy
from gpca.experiments.controls.protocol import LABELS
from gpca.experiments.controls.settings import PAPER, TRANSFER, plain_of
from gpca.io.csv_file import numbers, read_numbers
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

CALLS = "icp_calls"
KEYS = ("control", "source", "trained_on", "explainer", "seed")
COLUMNS = (
    *("control", "source", "trained_on", "method", "metric", "samples", "seeds", "value", "low", "high"),
    *("change", "change_low", "change_high"),
    *("rival", "lead", "lead_low", "lead_high"),
    *("untrained", "gain", "gain_low", "gain_high"),
)
NUMBERS = tuple(name for name in COLUMNS[5:] if name not in ("rival", "untrained"))


def read_controls(prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the columns `KEYS`, sample, instance, concept, right, entropy, bald (NaN where none is) and icp_calls.

    ``source`` is the one tested; ``instance`` names the object with its source, views of one instance together. An
    abstained sample is wrong.

    Args:
        prediction_files: named ``…/{source trained on}/seed{seed}.csv``.

    Raises:
        InputError: no files, or a file that cannot be read.
    """
    import pandas as pd

    frames = []
    for path in prediction_files:
        _, trained_on, seed = source_method_seed(path)
        rows = read_predictions(path, LABELS)
        instances = rows["tested"] + "/" + rows["cluster"]
        frames.append(
            pd.DataFrame(
                {
                    "control": rows["control"],
                    "source": rows["tested"],
                    "trained_on": trained_on,
                    "explainer": rows["explainer"],
                    "seed": seed,
                    "sample": rows["sample"],
                    "instance": instances,
                    "concept": rows["concept_true"],
                    "right": (rows["concept_true"] == rows["concept_predicted"]) & ~rows["abstained"],
                    "entropy": numbers(path, rows, "entropy"),
                    "bald": numbers(path, rows, "bald", needed=rows["bald"] != ""),
                    "icp_calls": rows["icp_calls"],
                }
            )
        )
    if not frames:
        raise InputError("controls", "no files were given", "name at least one explainer in controls.explainers")
    return pd.concat(frames, ignore_index=True)


def collect(prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return tidy metrics of every control, source tested, explainer and seed; the column ``table`` is the control.

    - accuracy: share of the test samples that are named rightly.
    - auroc_error, auroc_error_bald: how well entropy, and BALD where there is one, tell wrong from right. Where nothing
      is wrong, or everything, there is none.
    - test_samples: their number.

    The column ``concept`` is ``all``, and for transfer the source that was trained on.

    Raises:
        InputError: see :func:`gpca.experiments.controls.metrics.read_controls`.
    """
    records = []
    judged = read_controls(prediction_files)
    for (control, source, trained_on, explainer, seed), rows in judged.groupby(list(KEYS), sort=False):
        concept = trained_on if control == TRANSFER else ALL
        values = {"accuracy": rows["right"].mean(), "test_samples": len(rows)}
        one_1_N = np.ones((1, len(rows)))
        for metric, score in (("auroc_error", "entropy"), ("auroc_error_bald", "bald")):
            values[metric] = auroc_error(rows, score, one_1_N)[0]
        records += [
            (control, source, explainer, metric, concept, seed, float(value))
            for metric, value in values.items()
            if np.isfinite(value)
        ]
    return tidy(records, "controls")


def auroc_error(rows: pd.DataFrame, score: str, weights_B_N: np.ndarray) -> np.ndarray:
    """Return the area (B,) under the ROC curve by which a score tells wrong from right; NaN where it cannot."""
    if rows[score].isna().any():
        return np.full(len(weights_B_N), np.nan)
    return ranking(rows[score].to_numpy(), ~rows["right"].to_numpy(), weights_B_N)["area"]


def collect_intervals(prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return accuracy and auroc_error of every control and explainer over all seeds, with 95 % intervals.

    By the source tested, and pooled over all. Of transfer there is a row for each source trained on, and one for all
    others together, whose ``trained_on`` is pooled. The change is the value minus the paper's protocol's, for the
    same seeds; of an explainer whose encoder is trained otherwise, minus its own with the paper's training, on the same
    samples. The lead is the accuracy minus that of the best other explainer, the gain minus that of the best that needs
    no training, under the same control and on the same draws. The number of ICP calls is of the paper's protocol.
    """
    import pandas as pd

    judged = read_controls(prediction_files)
    sources = list(dict.fromkeys(judged["source"]))
    records: list[tuple] = []
    for source in (*sources, POOLED) if len(sources) > 1 else sources:
        of_source = judged if source == POOLED else judged[judged["source"] == source]
        measured: list[tuple[str, Group, Measured, Mapping[str, np.ndarray]]] = []
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
                against, _, _ = _measures(compared[other], weights_of_compared[:, other.to_numpy()])
                measured.append((str(explainer), (control, trained_on), own, against))
        records += _records(source, measured)
    return pd.DataFrame(records, columns=list(COLUMNS))


def read_intervals(path: str | Path) -> pd.DataFrame:
    """Read what :func:`collect_intervals` returned: without auroc_error where nothing is wrong, with some bounds NaN.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a value that is no finite number.
    """
    return read_numbers(path, COLUMNS, NUMBERS, optional=NUMBERS[3:])


# Values by metric; numbers of samples and seeds; how often each draw has each sample.
Measured = tuple[dict[str, np.ndarray], tuple[int, int], np.ndarray]
Group = tuple[str, str]  # control, trained on


def _weights(source: str, rows: pd.DataFrame) -> np.ndarray:
    """Return the weights (B, N) of the samples as they are, and then of every draw."""
    factors = (rows["seed"].to_numpy(), rows["instance"].to_numpy(str))
    drawn_B_N = pigeonhole_weights(generator("control intervals", source), *factors)
    return np.vstack([np.ones(len(rows)), drawn_B_N])


def _records(source: str, measured: Sequence[tuple[str, Group, Measured, Mapping[str, np.ndarray]]]) -> Iterator[tuple]:
    """Yield the rows of a source, of the measures of every explainer in every group and what it is compared with."""
    accuracies: dict[Group, dict[str, np.ndarray]] = {}
    for explainer, group, (values, _, _), _ in measured:
        accuracies.setdefault(group, {})[explainer] = values["accuracy"]
    for explainer, group, (values, counts, drawn_B_N), against in measured:
        control, trained_on = group
        rivals = [name for name in accuracies[group] if not plain_of(name)]
        for metric, value_B in values.items():
            if not np.isfinite(value_B[0]):
                continue
            change_B = value_B - against[metric]
            own = (control, source, trained_on, explainer, metric, *counts)
            estimate = interval(value_B, None if metric == CALLS else drawn_B_N)
            is_itself = control == PAPER and not plain_of(explainer)  # of which there is nothing to doubt
            change = interval(change_B, None if is_itself else drawn_B_N, difference=True)
            lead = gain = Difference()
            if metric == "accuracy":
                lead = from_rival(accuracies[group], explainer, rivals, drawn_B_N=drawn_B_N)
                gain = from_untrained(accuracies[group], explainer, drawn_B_N=drawn_B_N)
            yield (*own, *estimate, *change, *lead.cells, *gain.cells)


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
    if (rows["control"] == PAPER).all():
        measures[CALLS] = np.full(len(weights_B_N), rows["icp_calls"].mean())
    return measures, (len(rows), rows["seed"].nunique()), weights_B_N[1:]
