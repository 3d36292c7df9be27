"""Makes the tables of learners and of the worth of their uncertainty (Table V).

The intervals are what :func:`gpca.experiments.out_of_distribution.intervals.collect_intervals` returned.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING, Any

from gpca.experiments.out_of_distribution.intervals import RHO
from gpca.experiments.out_of_distribution.metrics import TABLE, with_training_like
from gpca.experiments.out_of_distribution.sets import TRAINED_ON
from gpca.objects.entry import stand_in_clause, title_of
from gpca.reporting.tables.builder import TableBuilder, crossed, over_clusters, titles_of
from gpca.reporting.tables.cells import clustered_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import in_words, span

if TYPE_CHECKING:
    import pandas as pd

PRINTED_SOURCE = "ycb"  # the paper prints ρ, AUC and ECE of it
_AREA: dict[str, Any] = {"decimals": 4, "limits": (0, 1), "least_is_best": True}
_ERROR: dict[str, Any] = {"decimals": 3, "limits": (0, 1), "least_is_best": True}
_RHO: dict[str, Any] = {"decimals": 3, "limits": (-1, 1)}
SHIFTED = {"severity": "severities beyond", "source": "unseen source", "objects": "unseen objects"}
OF_DISTANCE = (
    "ρ: Spearman's correlation of 1 - largest score with the distance to the training samples, the mean over the "
    "nearest ones in the space of the analytical features; diagnostics.csv has the other scores and distances."
)
OF_SEEDS = "ρ, areas and ECE are those of each seed, mean."
AREA = "AURC: the area under the curve of risk over coverage, which is the mean risk; the paper's AUC."
CALIBRATION = "ECE: expected calibration error over 15 equally wide bins."


def table5_learners(intervals: pd.DataFrame, sources: Mapping[str, Mapping], learners: Mapping[str, str]) -> Table:
    """Return accuracy and diagnostics of every learner on test samples like the training's (paper, Table V)."""
    quantities = {
        "accuracy": ("accuracy", Column("Accuracy (%)")),
        "rho": (RHO, Column("ρ", **_RHO)),
        "aurc": ("aurc_max_score", Column("AURC", **_AREA)),
        "excess_aurc": ("excess_aurc_max_score", Column("E-AURC", **_AREA)),
        "augrc": ("augrc_max_score", Column("AUGRC", **_AREA)),
        "ece": ("ece", Column("ECE (share)", **_ERROR)),
        "nll": ("nll", Column("NLL (nats)", decimals=3, limits=(0, inf), least_is_best=True)),
        "brier": ("brier", Column("Brier", decimals=3, limits=(0, 2), least_is_best=True)),
    }
    picks = {key: ("in_distribution", metric) for key, (metric, _) in quantities.items()}
    table = _by_learner("table5_learners", intervals, sources, learners, picks)
    return table.build(
        caption="Accuracy and uncertainty of learners on the same embeddings" + table.stand_in_clause(sources),
        column_head="quantity",
        columns={key: column for key, (_, column) in quantities.items()},
        footnotes=(
            repeats_note(table, intervals),
            OF_DISTANCE,
            f"{AREA} E-AURC: AURC minus the least possible with as many errors; AUGRC: mean share of undetected "
            f"failures. {CALIBRATION}",
        ),
    )


def table5_compact(intervals: pd.DataFrame, sources: Mapping[str, Mapping], learners: Mapping[str, str]) -> Table:
    """Return Table V as the paper has it: a row per learner, accuracies by source, diagnostics on one source."""
    one = PRINTED_SOURCE if PRINTED_SOURCE in sources else list(sources)[-1]
    diagnostics = {"rho": RHO, "aurc": "aurc_max_score", "ece": "ece"}
    table = TableBuilder("table5_compact", {"learner": "Learner"})
    for learner, title in learners.items():
        cells = {source: _cell(intervals, source, learner, "in_distribution", "accuracy") for source in sources}
        cells |= {key: _cell(intervals, one, learner, "in_distribution", name) for key, name in diagnostics.items()}
        table.add_row([(learner, title)], cells)
    shown = [source for source in sources if any(key == source for _, key in table.cells)]
    columns = {source: Column(f"{title_of(entry)} (%)") for source, entry in sources.items()}
    columns |= {"rho": Column("ρ", **_RHO), "aurc": Column("AURC", **_AREA), "ece": Column("ECE (share)", **_ERROR)}
    table.compare_down(columns)
    seeds = table.most_seeds()
    samples = span(samples_of_seed(intervals, source, "in_distribution") for source in shown)
    return table.build(
        caption=f"Accuracy of learners by dataset, and what their uncertainty is worth on {sources[one]['title']}"
        + stand_in_clause(sources.values()),
        column_head="quantity",
        columns=columns,
        footnotes=(
            f"{over_clusters(seeds, samples)}. {OF_SEEDS} Bold: best of a column.",
            OF_DISTANCE,
            f"{AREA} {CALIBRATION}",
        ),
    )


def table5_shift(intervals: pd.DataFrame, sources: Mapping[str, Mapping], learners: Mapping[str, str]) -> Table:
    """Return accuracy, calibration and ρ of every learner on samples unlike those of the training."""
    columns: dict[str, Column] = {}
    picks: dict[str, tuple[str, str]] = {}
    for name, title in SHIFTED.items():
        columns |= {
            f"accuracy_{name}": Column(f"Acc., {title} (%)"),
            f"ece_{name}": Column(f"ECE, {title} (share)", **_ERROR),
            f"rho_{name}": Column(f"ρ, {title}", **_RHO),
        }
        picks |= {
            f"accuracy_{name}": (name, "accuracy"),
            f"ece_{name}": (name, "ece"),
            f"rho_{name}": (with_training_like(name), RHO),
        }
    table = _by_learner("table5_shift", intervals, sources, learners, picks)
    return table.build(
        caption="Learners on samples unlike those of the training" + table.stand_in_clause(sources),
        column_head="quantity",
        columns=columns,
        footnotes=(
            repeats_note(table, intervals),
            f"{OF_DISTANCE} It is taken over the shifted samples and those like the training's together.",
            f"Unseen objects: another encoder and other learners, which never saw some of the objects. {CALIBRATION}",
        ),
    )


def _by_learner(
    name: str,
    intervals: pd.DataFrame,
    sources: Mapping[str, Mapping],
    learners: Mapping[str, str],
    picks: Mapping[str, tuple[str, str]],
) -> TableBuilder:
    """Return a table with a row for each source and learner, and a cell for each pick of a set and a metric."""
    table = TableBuilder(name, {"source": "Dataset", "learner": "Learner"})
    for (source, learner), labels in crossed(titles_of(sources), learners):
        table.add_row(labels, {key: _cell(intervals, source, learner, *pick) for key, pick in picks.items()})
    table.compare_down(picks, same=1)
    return table


def _cell(intervals: pd.DataFrame, source: str, learner: str, of_set: str, metric: str) -> Cell | None:
    scale = 100 if metric == "accuracy" else 1
    return clustered_cell(intervals, scale, table=TABLE + of_set, source=source, method=learner, metric=metric)


def samples_of_seed(intervals: pd.DataFrame, source: str, of_set: str) -> int:
    """Return the test samples of a seed in a set."""
    rows = rows_where(intervals, table=TABLE + of_set, source=source, metric="accuracy")
    return int((rows["samples"] // rows["seeds"]).max())


def repeats_note(table: TableBuilder, intervals: pd.DataFrame) -> str:
    """Return the footnote on the repeats, with the test samples of every set that there is."""
    source = table.first_labels()[0]
    counts = [
        f"{samples_of_seed(intervals, source, name)} {in_words(name)}"
        for name in TRAINED_ON
        if len(rows_where(intervals, table=TABLE + name, source=source))
    ]
    return (
        f"{over_clusters(table.most_seeds())}. {OF_SEEDS} Test samples of a seed (of the first dataset): "
        f"{', '.join(counts)}. Bold: best of a dataset."
    )
