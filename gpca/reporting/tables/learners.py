"""The tables of learners and of what their uncertainty is worth (paper, Table V), from the tidy diagnostics.

All take the same arguments and raise the same error:

    metrics: as :func:`gpca.shift.metrics.collect_diagnostics` makes them.
    sources: name -> ``{"title": str, "stand_in": bool}``, in the order of the rows.
    learners: name -> title, in the order in which they are shown.
    InputError: the metrics hold none of these sources and learners.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import inf
from typing import TYPE_CHECKING, Any

from gpca.objects.title import title_of
from gpca.reporting.tables.builder import INTERVAL, TableBuilder, cell_of_repeats, rows_where
from gpca.reporting.tables.explainers import GPCA_FORMS
from gpca.reporting.tables.table import EMPTY, Cell, Column, Table
from gpca.reporting.words import plural
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
_NOTHING = ("diagnostics", "hold nothing", "run its learners first")  # where a table would have no row
_OF_DISTANCE = (
    "ρ: Spearman's correlation of 1 - largest score with the distance to the training samples, the mean over the "
    "nearest ones in the space of the analytical features; diagnostics.csv has the other scores and distances."
)


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
    picks = {key: ("in_distribution", metric) for key, (metric, _) in quantities.items()}
    metrics = _only(metrics, [metric for _, metric in picks.values()])
    table = _by_learner("table5_learners", metrics, sources, learners, picks)
    return table.build(
        caption="Accuracy and uncertainty of learners on the same embeddings" + table.stand_in_clause(sources),
        column_head="quantity",
        columns={key: column for key, (_, column) in quantities.items()},
        footnotes=(
            _repeats(table, metrics),
            _OF_DISTANCE,
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
    metrics = _only(metrics, [metric for _, metric in picks.values()])
    table = _by_learner("table5_shift", metrics, sources, learners, picks)
    return table.build(
        caption="Learners on samples unlike those of the training" + table.stand_in_clause(sources),
        column_head="quantity",
        columns=columns,
        footnotes=(
            _repeats(table, metrics),
            f"{_OF_DISTANCE} It is taken over the shifted samples and those like the training's together.",
            "Unseen objects: encoder and learners are others, which never saw some of the objects.",
        ),
    )


def table5_claims(metrics: pd.DataFrame, sources: Mapping[str, Mapping], learners: Mapping[str, str]) -> Table:
    """The paper's two claims about the GPC, answered with the differences paired by seed."""
    sets = {"accuracy": ["in_distribution"], "rho": [with_training_like(name) for name in SHIFTED]}
    metrics = _only(metrics, ["accuracy", RHO])
    table = TableBuilder(
        "table5_claims",
        {
            "source": "Dataset",
            "learner": "GPC",
            "rival": "Rival",
            "accurate": "As accurate or more",
            "tracks": "Tracks shift better",
        },
    )
    for source, entry in sources.items():
        for own in (name for name in GPCA_FORMS if name in learners):
            for rival in (name for name in RIVALS if name in learners):
                accuracy = _paired(metrics, source, sets["accuracy"], "accuracy", own, rival)
                rho = _paired(metrics, source, sets["rho"], RHO, own, rival)
                accurate = _answer(accuracy, may_be_equal=True)
                tracks = _answer(rho, may_be_equal=False)
                table.add_row(
                    [
                        (source, title_of(entry)),
                        (own, learners[own]),
                        (rival, learners[rival]),
                        (accurate, accurate),
                        (tracks, tracks),
                    ],
                    {"accuracy": accuracy, "rho": rho},
                )
    table.require_rows(*_NOTHING)
    return table.build(
        caption="Whether the GPC is as accurate as forest and SVM and tracks distributional shift better"
        + table.stand_in_clause(sources),
        column_head="difference",
        columns={
            "accuracy": Column("Accuracy (%)", limits=(-100, 100)),
            "rho": Column("ρ", decimals=3, limits=(-2, 2)),
        },
        footnotes=(
            _repeats(table, metrics),
            "GPC minus rival, paired by seed. As accurate or more: yes unless the whole interval lies below zero. "
            f"Tracks shift better: yes only where the whole interval lies above zero. {EMPTY}: one seed, no interval.",
            f"{_OF_DISTANCE} Here it is the mean over the three kinds of shift of table5_shift.",
        ),
    )


LEARNER_TABLES = {table.__name__: table for table in (table5_learners, table5_shift, table5_claims)}


def _by_learner(
    name: str,
    metrics: pd.DataFrame,
    sources: Mapping[str, Mapping],
    learners: Mapping[str, str],
    picks: Mapping[str, tuple[str, str]],
) -> TableBuilder:
    """Return a table with a row for each source and learner, and a cell for each pick of a set and a metric."""
    table = TableBuilder(name, {"source": "Dataset", "learner": "Learner"})
    for source, entry in sources.items():
        for learner, title in learners.items():
            cells = {key: _cell(metrics, source, learner, *pick) for key, pick in picks.items()}
            table.add_row([(source, title_of(entry)), (learner, title)], cells)
    table.require_rows(*_NOTHING)
    table.compare_down(picks, same=1)
    return table


def _only(metrics: pd.DataFrame, names: Iterable[str]) -> pd.DataFrame:
    """Return the rows of these metrics, and of the numbers of samples: one in twenty, to be searched many times."""
    return metrics[metrics["metric"].isin(["test_samples", *names])]


def _values(metrics: pd.DataFrame, source: str, learner: str, of_set: str, metric: str) -> pd.Series:
    """Return the values over the seeds, by seed."""
    chosen = rows_where(metrics, table=TABLE + of_set, source=source, method=learner, metric=metric)
    return chosen.set_index("seed")["value"]


def _scale(metric: str) -> int:
    """Return the factor from a metric's unit to the printed one; only accuracies are printed in %."""
    return 100 if metric == "accuracy" else 1


def _cell(metrics: pd.DataFrame, source: str, learner: str, of_set: str, metric: str) -> Cell | None:
    values = _values(metrics, source, learner, of_set, metric)
    if values.empty:
        return None
    return cell_of_repeats(values * _scale(metric), _samples(metrics, source, of_set) * len(values))


def _samples(metrics: pd.DataFrame, source: str, of_set: str) -> int:
    """Return the test samples of a seed in a set, or in sets that are joined by '+'."""
    total = 0
    for name in of_set.split("+"):
        counted = rows_where(metrics, table=TABLE + name, source=source, metric="test_samples")
        total += int(counted["value"].max())
    return total


def _paired(metrics: pd.DataFrame, source: str, sets: list[str], metric: str, own: str, rival: str) -> Cell | None:
    """Return the difference of two learners, the mean over the sets of which both have the metric, then over seeds."""
    kept: dict[str, pd.Series] = {}
    for of_set in sets:
        of_own = _values(metrics, source, own, of_set, metric)
        difference = (of_own - _values(metrics, source, rival, of_set, metric)).dropna()
        if len(difference):
            kept[of_set] = difference
    if not kept:
        return None
    of_seed = sum(kept.values()) / len(kept) * _scale(metric)
    samples = sum(_samples(metrics, source, of_set) for of_set in kept)
    return cell_of_repeats(of_seed, samples * len(of_seed))


def _answer(cell: Cell | None, may_be_equal: bool) -> str:
    """Return whether a difference is positive, or at least not negative where it may be zero."""
    if cell is None or cell.seeds == 1:
        return EMPTY
    if may_be_equal:
        return "yes" if cell.mean + cell.half_width >= 0 else "no"
    return "yes" if cell.mean - cell.half_width > 0 else "no"


def _repeats(table: TableBuilder, metrics: pd.DataFrame) -> str:
    """Return the footnote on the repeats, with the test samples of every set that there is."""
    source = table.first_labels()[0]
    counts = [
        f"{_samples(metrics, source, name)} {name.replace('_', ' ')}"
        for name in TRAINED_ON
        if (metrics["table"] == TABLE + name).any()
    ]
    return (
        f"Mean over {plural(table.most_seeds(), 'seed')}; {INTERVAL}. Test samples of a seed (of the first dataset): "
        f"{', '.join(counts)}."
    )
