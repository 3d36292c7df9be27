"""Makes Table IX by parts of the samples, and Table IX by the registration that is shown."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.causes.judged import CEILING
from gpca.evaluation.intervals import REPEATS
from gpca.evaluation.measures import POOLED
from gpca.experiments.diagnosis.strata import LARGE_ERROR, LARGE_MARGIN, SMALL_ERROR, SMALL_MARGIN
from gpca.experiments.diagnosis.tables import AGAIN
from gpca.objects.entry import stand_in_clause
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.cells import interval_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

UNTRAINED = ("chance", "most_frequent", "rule", "reenact")
PAPER = "gpca"  # GP-CA on the paper's input


def _between(small: float, large: float) -> dict[str, str]:
    low, high = f"{100 * small:g}", f"{100 * large:g}"
    return {"small": f"below {low} % d", "middle": f"{low} to {high} % d", "large": f"{high} % d or more"}


KINDS = {
    "state": ("State", {"nominal": "nominal", "failed": "failed"}),
    "margin": ("Failed: the largest φ exceeds the next by", _between(SMALL_MARGIN, LARGE_MARGIN)),
    "causes": ("Failed: number of causes", {"one": "one", "two": "two", "three": "three"}),
    "symmetry": ("Failed: object", {"symmetric": "symmetric (ADD-S)", "other": "other (ADD)"}),
    "error": ("Failed: mean error", _between(SMALL_ERROR, LARGE_ERROR)),
    "shown": ("Failed: the registration shown", {"failed": "failed itself", "other": "did not fail itself"}),
}
SHOWN_STATES = {
    "state_accuracy": Column("State, mean (%)"),
    "state_accuracy_shown": Column("State, shown (%)"),
    "auroc_failed": Column("AUROC, mean", decimals=3, limits=(0.0, 1.0)),
    "auroc_failed_shown": Column("AUROC, shown", decimals=3, limits=(0.0, 1.0)),
}


def table9_strata(strata: pd.DataFrame, sources: Mapping[str, Mapping], explainers: Mapping[str, str]) -> Table:
    """Return for every stratum how often a few explainers are right, and what their answer leaves on the table.

    Args:
        strata: What :func:`gpca.experiments.diagnosis.strata.collect_strata` returned.
    """
    chosen = _chosen(strata, explainers)
    table = TableBuilder("table9_strata", {"kind": "Part", "stratum": "of the samples"})
    columns = {"samples": Column("n", decimals=0, interval=False, limits=(0.0, inf))}
    for name, title in chosen.items():
        columns[f"{name}_named_right"] = Column(f"{title}: right (%)", interval=name != CEILING)
        columns[f"{name}_regret"] = Column(f"{title}: regret (%)", interval=False, limits=(0.0, inf))
    for kind, (title_of_kind, titles) in KINDS.items():
        for stratum, title in titles.items():
            rows = rows_where(strata, kind=kind, stratum=stratum)
            cells = {}
            for name in chosen:
                for metric, row in rows_where(rows, method=name).set_index("metric").iterrows():
                    cells[f"{name}_{metric}"] = interval_cell(row)
                    judged = int(row["samples"])
                    cells["samples"] = plain_cell(judged, int(row["seeds"]), judged)
            table.add_row([(kind, title_of_kind), (stratum, title)], cells)
    return table.build(
        caption="Parts of the registrations with measured causes" + stand_in_clause(sources.values()),
        column_head="explainer",
        columns=columns,
        footnotes=(
            f"All datasets and {plural(table.most_seeds(), 'seed')} together, without borderline samples. In brackets: "
            f"the 95 % interval of {REPEATS} bootstrap draws over objects and seeds.",
            "Right: share whose label is named, where for a failure any cause counts whose φ is within the limit of a "
            "cause of the largest. Regret: of the failed, the share of the error that removing the best single cause "
            "would take away and removing the named one does not; who names nominal removes nothing.",
            f"Shown are {', '.join(chosen.values())}: what is not trained, GP-CA on the paper's input, the trained one "
            "with the least regret, and the truth from other starts, which no observer has.",
        ),
    )


def table9_shown(intervals: pd.DataFrame, sources: Mapping[str, Mapping], explainers: Mapping[str, str]) -> Table:
    """Return how well explainers tell the state by the mean over starts, and that of the registration shown.

    Args:
        intervals: What :func:`gpca.experiments.diagnosis.metrics.collect_intervals` returned.
    """
    found = set(intervals["source"])
    pooled = POOLED if POOLED in found else next(name for name in sources if name in found)
    of_all = rows_where(intervals, source=pooled)
    table = TableBuilder("table9_shown", {"explainer": "Explainer"})
    for name, title in {**explainers, **AGAIN}.items():
        rows = rows_where(of_all, method=name).set_index("metric")
        cells = {
            key: interval_cell(rows.loc[key], factor=100 if key.startswith("state") else 1)
            for key in SHOWN_STATES
            if key in rows.index
        }
        table.add_row([(name, title)], cells, rival=name != CEILING)
    table.require_rows()
    table.compare_down(SHOWN_STATES)
    counts = of_all.groupby("metric")["samples"].max()
    return table.build(
        caption="Who says that a registration failed: by the mean over starts, and by the registration that is shown"
        + stand_in_clause(sources.values()),
        column_head="metric",
        columns=SHOWN_STATES,
        footnotes=(
            f"Mean: {counts['state_accuracy']:.0f} test samples whose mean error over starts is nominal or failed. "
            f"Shown: {counts['state_accuracy_shown']:.0f} whose registration, the one that the explainer sees, has an "
            "error of its own below the nominal limit or above that of failures. The share of the failed whose own "
            "registration did not fail stands in `table9_strata`.",
            "State: mean share of the nominal and of the failed that is called so. AUROC: of failed against nominal. "
            f"All datasets and {plural(table.most_seeds(), 'seed')} together. In brackets: the 95 % interval of "
            f"{REPEATS} bootstrap draws over objects and seeds. Bold: best explainer.",
        ),
    )


def _chosen(strata: pd.DataFrame, explainers: Mapping[str, str]) -> dict[str, str]:
    """Return the titles of those shown: untrained, the paper's, the trained one of least regret, the ceiling."""
    of_failed = rows_where(strata, kind="state", stratum="failed", metric="regret").set_index("method")["value"]
    trained = [name for name in explainers if name in of_failed.index and name not in (*UNTRAINED, PAPER)]
    names = [name for name in (*UNTRAINED, PAPER) if name in explainers and name in of_failed.index]
    names += sorted(trained, key=lambda name: of_failed[name])[:1]
    return {name: explainers[name] for name in names} | AGAIN
