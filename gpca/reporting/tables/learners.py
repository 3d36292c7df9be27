"""The tables of learners and of what their uncertainty is worth (paper, Table V), from the tidy diagnostics.

All take the same arguments and raise the same error:

    metrics: as :func:`gpca.shift.metrics.collect_diagnostics` makes them.
    sources: name -> ``{"title": str, "stand_in": bool}``, in the order of the rows.
    learners: name -> title, in the order in which they are shown.
    InputError: the metrics hold none of these sources and learners.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING, Any

from gpca.attribution.metrics import mean_interval
from gpca.errors import InputError
from gpca.objects.title import STAND_IN, title_of
from gpca.reporting.tables.explainers import GPCA_FORMS
from gpca.reporting.tables.table import EMPTY, Cell, Cells, Column, Rows, Table
from gpca.shift.metrics import TABLE, with_training_like
from gpca.shift.sets import DISTANCES, TRAINED_ON

if TYPE_CHECKING:
    import pandas as pd

SHIFTED = {"severity": "severities beyond", "source": "unseen source", "objects": "unseen objects"}
RIVALS = ("learner_forest", "learner_linear_svm")  # the paper's
RHO = f"rho_max_score_{DISTANCES[0]}"
_AREA: dict[str, Any] = {"decimals": 4, "limits": (0, 1), "least_is_best": True}
_ERROR: dict[str, Any] = {"decimals": 3, "limits": (0, 1), "least_is_best": True}
_RHO: dict[str, Any] = {"decimals": 3, "limits": (-1, 1)}


def table5_learners(metrics: pd.DataFrame, sources: Mapping[str, Mapping], learners: Mapping[str, str]) -> Table:
    """Accuracy and diagnostics of every learner on test samples like the training's (paper, Table V)."""
    quantities = {
        "accuracy": ("accuracy", Column("Accuracy (%)")),
        "rho": (RHO, Column("ρ", **_RHO)),
        "aurc": ("aurc_max_score", Column("AUC", **_AREA)),
        "excess_aurc": ("excess_aurc_max_score", Column("E-AUC", **_AREA)),
        "augrc": ("augrc_max_score", Column("AUGRC", **_AREA)),
        "ece": ("ece", Column("ECE", **_ERROR)),
        "nll": ("nll", Column("NLL", decimals=3, limits=(0, inf), least_is_best=True)),
        "brier": ("brier", Column("Brier", decimals=3, limits=(0, 2), least_is_best=True)),
    }
    columns = {key: column for key, (_, column) in quantities.items()}
    picks = {key: ("in_distribution", metric) for key, (metric, _) in quantities.items()}
    return _of_learners(
        metrics,
        sources,
        learners,
        picks,
        name="table5_learners",
        caption="Accuracy and uncertainty of learners on the same embeddings",
        columns=columns,
        notes=(
            _of_distance(),
            "AUC: area under risk and coverage, the mean risk; E-AUC: less the least that so many errors allow; AUGRC: "
            "mean share of undetected failures. ECE over 15 equally wide bins; NLL in nats.",
        ),
    )


def table5_shift(metrics: pd.DataFrame, sources: Mapping[str, Mapping], learners: Mapping[str, str]) -> Table:
    """Accuracy, calibration and ρ of every learner where the samples are unlike those of the training."""
    columns: dict[str, Column] = {}
    picks: dict[str, tuple[str, str]] = {}
    for name, title in SHIFTED.items():
        columns |= {
            f"accuracy_{name}": Column(f"Acc., {title} (%)"),
            f"ece_{name}": Column("ECE", **_ERROR),
            f"rho_{name}": Column("ρ", **_RHO),
        }
        picks |= {
            f"accuracy_{name}": (name, "accuracy"),
            f"ece_{name}": (name, "ece"),
            f"rho_{name}": (with_training_like(name), RHO),
        }
    return _of_learners(
        metrics,
        sources,
        learners,
        picks,
        name="table5_shift",
        caption="Learners on samples unlike those of the training",
        columns=columns,
        notes=(
            _of_distance() + " It is taken over the shifted samples and those like the training's together.",
            "Unseen objects: encoder and learners are others, which never saw some of the objects.",
        ),
    )


def table5_claims(metrics: pd.DataFrame, sources: Mapping[str, Mapping], learners: Mapping[str, str]) -> Table:
    """The paper's two claims about the GPC, answered with the differences paired by seed."""
    metrics = _only(metrics, "accuracy", RHO)
    rows: Rows = []
    cells: Cells = {}
    for source, entry in sources.items():
        for own in (name for name in GPCA_FORMS if name in learners):
            for rival in (name for name in RIVALS if name in learners):
                found = {
                    "accuracy": _paired(metrics, source, ["in_distribution"], "accuracy", own, rival, 100),
                    "rho": _paired(metrics, source, [with_training_like(name) for name in SHIFTED], RHO, own, rival, 1),
                }
                answers = (_answer(found["accuracy"], may_be_equal=True), _answer(found["rho"], may_be_equal=False))
                cells |= {(len(rows), key): cell for key, cell in found.items() if cell}
                named = ((own, learners[own]), (rival, learners[rival]))
                rows += [((source, title_of(entry)), *named, *((a, a) for a in answers))] if any(found.values()) else []
    return _table(
        metrics,
        sources,
        rows,
        cells,
        name="table5_claims",
        caption="Whether the GPC is as accurate as forest and SVM and tracks distributional shift better",
        row_heads={
            "source": "Dataset",
            "learner": "GPC",
            "rival": "Rival",
            "accurate": "As accurate or more",
            "tracks": "Tracks shift better",
        },
        columns={
            "accuracy": Column("Accuracy (%)", limits=(-100, 100)),
            "rho": Column("ρ", decimals=3, limits=(-2, 2)),
        },
        column_head="difference",
        notes=(
            "GPC minus rival, paired by seed. As accurate or more: yes unless the whole interval lies below zero. "
            f"Tracks shift better: yes only where the whole interval lies above zero. {EMPTY}: one seed, no interval.",
            _of_distance() + " Here it is the mean over the three kinds of shift of table5_shift.",
        ),
    )


LEARNER_TABLES = {table.__name__: table for table in (table5_learners, table5_shift, table5_claims)}


def _of_distance() -> str:
    return (
        "ρ: Spearman's correlation of 1 - largest score with the distance to the training samples, the mean over the "
        "nearest ones in the space of the analytical features; diagnostics.csv has the other scores and distances."
    )


def _of_learners(metrics, sources, learners, picks: Mapping[str, tuple[str, str]], **fields) -> Table:
    metrics = _only(metrics, *(metric for _, metric in picks.values()))
    rows: Rows = []
    cells: Cells = {}
    compared: list[list[tuple[int, str]]] = []
    for source, entry in sources.items():
        first = len(rows)
        for learner, title in learners.items():
            of_row = {
                key: cell
                for key, (of_set, metric) in picks.items()
                if (cell := _cell(_values(metrics, source, of_set, metric, learner), metrics, source, of_set, metric))
            }
            cells |= {(len(rows), key): cell for key, cell in of_row.items()}
            rows += [((source, title_of(entry)), (learner, title))] if of_row else []
        compared += [[(row, key) for row in range(first, len(rows))] for key in picks]
    return _table(
        metrics,
        sources,
        rows,
        cells,
        row_heads={"source": "Dataset", "learner": "Learner"},
        column_head="quantity",
        compared=tuple(compared),
        **fields,
    )


def _only(metrics: pd.DataFrame, *names: str) -> pd.DataFrame:
    """Return the rows of these metrics, and of the numbers of samples: one in twenty, to be searched many times."""
    return metrics[metrics["metric"].isin(["test_samples", *names])]


def _values(metrics: pd.DataFrame, source: str, of_set: str, metric: str, learner: str) -> pd.Series:
    """Return the values over the seeds, by seed."""
    chosen = (
        (metrics["table"] == TABLE + of_set)
        & (metrics["source"] == source)
        & (metrics["method"] == learner)
        & (metrics["metric"] == metric)
    )
    return metrics[chosen].set_index("seed")["value"]


def _cell(values: pd.Series, metrics, source: str, of_set: str, metric: str) -> Cell | None:
    if values.empty:
        return None
    mean, low, _ = mean_interval(values * (100 if metric == "accuracy" else 1))
    return Cell(mean, mean - low, len(values), _samples(metrics, source, of_set) * len(values))


def _samples(metrics: pd.DataFrame, source: str, of_set: str) -> int:
    """Return the test samples of a seed in a set, or in sets that are joined by '+'."""
    total = 0
    for name in of_set.split("+"):
        chosen = (metrics["table"] == TABLE + name) & (metrics["source"] == source)
        total += int(metrics.loc[chosen & (metrics["metric"] == "test_samples"), "value"].max())
    return total


def _paired(metrics, source: str, sets: list[str], metric: str, own: str, rival: str, scale: float) -> Cell | None:
    """Return the difference of two learners, the mean over the sets of which both have the metric, then over seeds."""
    differences = [
        (_values(metrics, source, of_set, metric, own) - _values(metrics, source, of_set, metric, rival)).dropna()
        for of_set in sets
    ]
    kept = [(of_set, each) for of_set, each in zip(sets, differences, strict=True) if len(each)]
    if not kept:
        return None
    of_seed = sum(each for _, each in kept) / len(kept) * scale
    mean, low, _ = mean_interval(of_seed)
    samples = sum(_samples(metrics, source, of_set) for of_set, _ in kept)
    return Cell(mean, mean - low, len(of_seed), samples * len(of_seed))


def _answer(cell: Cell | None, may_be_equal: bool) -> str:
    if cell is None or cell.seeds == 1:
        return EMPTY
    low, high = cell.mean - cell.half_width, cell.mean + cell.half_width
    return "yes" if (high >= 0 if may_be_equal else low > 0) else "no"


def _table(metrics, sources, rows: list, cells: Mapping, *, caption: str, notes: tuple[str, ...], **fields) -> Table:
    if not cells:
        raise InputError("diagnostics", f"hold nothing for {fields['name']}", "run its learners first")
    stand_ins = {labels[0][0]: bool(sources[labels[0][0]]["stand_in"]) for labels in rows}
    if any(stand_ins.values()):
        caption += f", {'' if all(stand_ins.values()) else 'partly '}on {STAND_IN}s of the datasets' objects"
    seeds = max(cell.seeds for cell in cells.values())
    counts = [
        f"{_samples(metrics, next(iter(stand_ins)), name)} {name.replace('_', ' ')}"
        for name in TRAINED_ON
        if (metrics["table"] == TABLE + name).any()
    ]
    repeats = (
        f"Mean over {seeds} seed{'s' * (seeds != 1)}; ± is the half-width of the 95 % t-interval over the seeds. Test "
        f"samples of a seed (of the first dataset): {', '.join(counts)}."
    )
    return Table(caption=caption, rows=tuple(rows), cells=cells, footnotes=(repeats, *notes), **fields)
