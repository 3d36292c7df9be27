"""Joint readings: a value of every choice that touches several of the paper's tables, and which numbers they fit.

A printed number depends only on the choices of its *part*, whose values form an array with an axis for every choice, of
length 1 where they do not depend on it. Shares of close numbers are sums of these arrays.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np

from gpca.active_learning.curves import CENSORED_BY
from gpca.comparison.chance import WITHIN, is_close, p_value, permuted, weights
from gpca.comparison.published import UNITS, Number
from gpca.comparison.verdicts import Tolerance
from gpca.io.csv_file import read_csv, read_numbers
from gpca.io.frame import Frame
from gpca.settings import Distinct, Keys, OpenShare

SEVERITIES = "severities"
PROTOCOL = "protocol"  # the severities of the protocol
# Severities of training and test samples; of the classifier, the scale of its inputs, where inducing inputs and
# lengthscale start, the samples of an iteration, kernel and schedule; the share of the new concept in the pool; how far
# SHAP and SA turn the knobs; the samples and the distance of ρ, and these samples of AUC and ECE.
CHOICES: Mapping[str, Any] = {
    SEVERITIES: Literal["protocol", "weaker", "stronger"],
    "inputs": Literal["standardised", "unit_norm", "raw"],
    "inducing": Literal["kmeans", "random"],
    "lengthscale": Literal["median", "default"],
    "batch": Literal["full", "minibatch"],
    "kernel": Literal["rbf", "matern32"],
    "new_share": OpenShare,
    "knobs": Literal["middle", "low", "high"],
    "set": Literal["in_distribution", "severity", "in_distribution+severity"],
    "distance": Literal["knn_analytical", "mahalanobis_analytical", "knn_embedding", "mahalanobis_embedding"],
}
Grid = Annotated[dict, Keys({name: Distinct[kind] for name, kind in CHOICES.items()}, required=CHOICES)]  # type: ignore[valid-type]
START = ("inputs", "inducing", "lengthscale", "batch")
PARTS = {  # part -> the choices that its numbers depend on
    "knobs": (SEVERITIES, "knobs"),  # Table I, SHAP and SA
    "schedules": (SEVERITIES, *START),  # Table IV
    "classifier": (SEVERITIES, *START, "kernel"),  # GP-CA of Tables I and II, accuracies of the GPC in V
    "labels": (SEVERITIES, *START, "kernel", "new_share"),  # Table III
    "learners": (SEVERITIES, "inputs"),  # accuracies of forest and SVM in Table V
    "diagnostics": (SEVERITIES, *START, "kernel", "set", "distance"),  # of the GPC in Table V
    "learner_diagnostics": (SEVERITIES, "inputs", "set", "distance"),  # of forest and SVM
}
TABLES = ("I", "II", "III", "IV", "V")
DEVELOPMENT, EVALUATION = "development", "evaluation"  # the samples that scores are of
EVALUATED, JUDGED = "joint_reading", "protocol"  # the joint reading, and the protocol that is judged
VERDICT_COLUMNS = (
    *("table", "row", "column", "unit", "published", "upper", "reproduced", "at_least", "close"),
    *("joint", "joint_at_least", "joint_close", "n", "readings", "readings_close"),
)
FLAGS = ("at_least", "close", "joint_at_least", "joint_close")
MOST_SHOWN = 20  # of the best readings
Joint = dict[str, Any]  # a value of every choice
Record = tuple[str, str, str, float]  # table or "all", method, metric, value


def part_name(part: str, joint: Joint) -> str:
    """Name of a part under a joint reading, as `table` of its tidy rows has it: ``knobs/weaker/low``."""
    return "/".join([part, *(text_of(joint[choice]) for choice in PARTS[part])])


def text_of(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def numbers_asked(numbers: Sequence[Number], sources: Sequence[str] | None = None) -> list[Number]:
    """The means of Tables I to V, each value of ours once; of these sources alone, if any are given."""
    return [
        number
        for number in numbers
        if number.table in TABLES
        and number.counterpart
        and number.counterpart.statistic == "mean"
        and not number.same_as
        and (sources is None or set(number.counterpart.sources) <= set(sources))
    ]


class Found(NamedTuple):
    """Result of a search."""

    joint: Joint  # the first of the readings with the largest share, in the order of the grid
    share: float
    close: np.ndarray  # (K,) which numbers are close under it
    best: list[tuple[Joint, float]]  # readings with the largest shares
    equals: int  # number of readings with the largest share
    readings: int  # number of all
    protocol: float  # share of the grid's first reading, in which every choice has the protocol's value
    by_chance: Mapping[str, np.ndarray]  # way of permuting -> (D,) largest share for each permutation


def search(
    numbers: Sequence[Number],
    printed: Sequence[Number],
    measured: Frame,
    grid: Mapping[str, Sequence[Any]],
    tolerances: Mapping[str, Tolerance],
    deals: int,
) -> Found:
    """Search every joint reading of a grid, which holds the values of every choice, the protocol's first."""
    shape = tuple(len(grid[choice]) for choice in CHOICES)
    closes = []  # whether each number's values are close to each printed one (P, …), with an axis for every choice
    for number in numbers:
        values = values_of(number, measured)
        part = next(iter(values)).partition("/")[0]
        axes = [len(grid[choice]) if choice in PARTS[part] else 1 for choice in CHOICES]
        close = np.zeros((len(printed), *axes), dtype=bool)  # never to numbers that do not take its place
        comparable = [i for i, other in enumerate(printed) if (other.table, other.unit) == (number.table, number.unit)]
        for at in product(*map(range, axes)):
            name = part_name(part, {choice: grid[choice][i] for choice, i in zip(CHOICES, at, strict=True)})
            for other in comparable:
                close[(other, *at)] = is_close(printed[other], *values[name], tolerances[number.unit])
        closes.append(close)
    weight_K = weights(numbers)
    index_K = np.array([printed.index(number) for number in numbers])
    share_G = _shares(closes, index_K, weight_K, shape)
    order = np.argsort(-np.round(share_G.ravel(), 9), kind="stable")
    best = []
    for index in order[:MOST_SHOWN]:
        axes_at = zip(CHOICES, np.unravel_index(index, shape), strict=True)
        best.append(({choice: grid[choice][int(i)] for choice, i in axes_at}, float(share_G.ravel()[index])))
    best_at = np.unravel_index(order[0], shape)
    close_K = [np.broadcast_to(close[index], shape)[best_at] for close, index in zip(closes, index_K, strict=True)]
    by_chance = {}
    for within in WITHIN:
        shares = (_shares(closes, dealt_P[index_K], weight_K, shape) for dealt_P in permuted(printed, within, deals))
        by_chance[within] = np.array([share.max() for share in shares])
    joint, largest = best[0]
    equals, protocol = int((share_G >= largest - 1e-9).sum()), float(share_G.ravel()[0])
    return Found(joint, largest, np.array(close_K), best, equals, share_G.size, protocol, by_chance)


def values_of(number: Number, measured: Frame) -> dict[str, tuple[float, bool]]:
    """Name of a part -> mean over the seeds in the number's unit, and whether some of it is a lower bound."""
    counterpart = number.counterpart
    assert counterpart
    [method], [metric] = counterpart.methods, counterpart.metrics
    rows = measured[(measured["method"] == method) & (measured["concept"] == counterpart.concept)]
    means = rows[rows["metric"] == metric].groupby("table", sort=False)["value"].mean()
    reached = rows[rows["metric"] == CENSORED_BY.get(metric)].groupby("table")["value"].min()
    factor = UNITS[number.unit].factor
    return {name: (factor * value, bool(reached.get(name, 1) < 1)) for name, value in means.items()}


def _shares(
    closes: Sequence[np.ndarray], printed_K: np.ndarray, weight_K: np.ndarray, shape: tuple[int, ...]
) -> np.ndarray:
    """Share of close numbers of every joint reading, if these printed numbers stand in the places of the numbers."""
    by_shape: dict[tuple[int, ...], np.ndarray] = {}
    for k, close in enumerate(closes):  # those that depend on the same choices are added up before the whole grid is
        weighted = weight_K[k] * close[printed_K[k]]
        by_shape[weighted.shape] = by_shape.get(weighted.shape, 0) + weighted
    return sum(by_shape.values(), np.zeros(shape))


def scores(
    numbers: Sequence[Number],
    close_K: np.ndarray,
    share: float,
    by_chance: Mapping[str, np.ndarray],
    method: str = EVALUATED,
) -> list[Record]:
    """Numbers and close ones of each table and of all, their share with equal weights of the tables, its chance."""
    records: list[Record] = []
    tables = np.array([number.table for number in numbers])
    parts = {table: close_K[tables == table] for table in dict.fromkeys(tables)} | {"all": close_K}
    for table, close in parts.items():
        records += [(table, method, "numbers", len(close)), (table, method, "close", close.sum())]
    records.append(("all", method, "share", share))
    for within, share_D in by_chance.items():
        records.append(("all", method, f"expected_{within}", share_D.mean()))
        records.append(("all", method, f"p_{within}", p_value(share, share_D)))
    return records


def scores_of_values(
    numbers: Sequence[Number],
    value_K: Sequence[tuple[float, bool]],
    tolerances: Mapping[str, Tolerance],
    deals: int,
    method: str,
) -> list[Record]:
    """:func:`scores` of a value for each number, with whether it is a lower bound."""
    close_K_K = np.zeros((len(numbers), len(numbers)), bool)
    for (k, number), (i, printed) in product(enumerate(numbers), repeat=2):
        close_K_K[k, i] = printed.unit == number.unit and is_close(printed, *value_K[k], tolerances[number.unit])
    index_K, weight_K = np.arange(len(numbers)), weights(numbers)
    by_chance = {
        within: np.array([close_K_K[index_K, printed_K] @ weight_K for printed_K in permuted(numbers, within, deals)])
        for within in WITHIN
    }
    close_K = close_K_K.diagonal()
    return scores(numbers, close_K, float(close_K @ weight_K), by_chance, method)


def judge(
    numbers: Sequence[Number],
    joint: Frame,
    comparison: Frame,
    readings: Frame,
    tolerances: Mapping[str, Tolerance],
    deals: int,
) -> tuple[list[tuple], list[Record]]:
    """A row of `VERDICT_COLUMNS` for each number, and the scores of the joint reading and of the protocol."""
    run_rows = comparison.set_index(["table", "row", "column"])[["reproduced", "at_least"]]
    counts = readings.groupby(["table", "row", "column"])["close"].agg(["size", "sum"])
    rows, joint_values, run_values = [], [], []
    for number in numbers:
        tolerance, sources = tolerances[number.unit], number.counterpart.sources if number.counterpart else ()
        measured = joint[joint["source"].isin(sources)]
        [value] = values_of(number, measured).values()
        reproduced, at_least = run_rows.loc[number.key]
        run_value = (float(reproduced or "nan"), at_least == "True")  # empty where the run has no such value
        upper = number.upper if number.upper > number.value else math.nan
        ours = (*run_value, is_close(number, *run_value, tolerance))
        theirs = (round(value[0], 6), value[1], is_close(number, *value, tolerance), measured["seed"].nunique())
        close = counts.loc[number.key].tolist() if number.key in counts.index else [0, 0]
        rows.append((*number.key, number.unit, number.value, upper, *ours, *theirs, *close))
        joint_values.append(value)
        run_values.append(run_value)
    records = scores_of_values(numbers, joint_values, tolerances, deals, EVALUATED)
    return rows, records + scores_of_values(numbers, run_values, tolerances, deals, JUDGED)


def read_verdicts(path: str | Path) -> Frame:
    optional = ("upper", "reproduced")
    measured = ("published", "joint", "n", "readings", "readings_close", *optional)
    rows = read_numbers(path, VERDICT_COLUMNS, measured, optional=optional)
    return rows.assign(**{column: rows[column] == "True" for column in FLAGS})


def read_choices(path: str | Path) -> Frame:
    return read_csv(path, ("choice", "value"))
