"""SHAP by a live function: whether a table of outcomes, computed beforehand, gives the values that shap finds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Annotated, Any

from gpca.declarations.experiment import Experiment
from gpca.declarations.plan import Run
from gpca.declarations.result import Frame, Paths, numbers, table
from gpca.declarations.step import Step
from gpca.evaluation.measures import read_all_metrics
from gpca.explainers.registry import explainer_module
from gpca.reporting.tables.builder import TableBuilder, crossed
from gpca.reporting.tables.cells import cell_of_repeats, rows_where
from gpca.reporting.tables.table import Column, Table
from gpca.reporting.words import plural
from gpca.settings import Bounds, Count
from gpca.steps.live_shap import LOOKUP

PLAIN: dict[str, Any] = {"interval": False, "limits": (0, inf)}
MEASURES = {  # column, and factor to its unit
    "largest_value": (Column("Largest value (nats)", decimals=3, **PLAIN), 1),
    "largest_difference": (Column("Largest difference (10⁻⁹ nats)", decimals=3, **PLAIN), 1e9),
    "named_alike": (Column("Named alike (%)", interval=False), 100),
    "live_icp_calls": (Column("ICP calls, live", decimals=0, **PLAIN), 1),
    "icp_calls": (Column("ICP calls, table", decimals=0, **PLAIN), 1),
    "test_samples": (Column("n", decimals=0, **PLAIN), 1),
}


@dataclass(frozen=True)
class Section:
    """The registrations for which ``shap.KernelExplainer`` calls a function that registers.

    Attributes:
        sources, seeds: how many of the run's are used, from the first.
        samples: of each source and seed, balanced.
    """

    sources: Count = 1
    seeds: Count = 1
    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)] = 3


def names(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """No sources where the compared explainer is left out."""
    section = config["live_shap"]
    is_made = LOOKUP in config["explainers"] and "additive" in config["uncertainty"]
    chosen = list(sources)[: section["sources"]] if is_made else []
    return {"live_source": chosen, "live_seed": list(config["seeds"])[: section["seeds"]]}


EXPERIMENT = Experiment(name="live_shap", sections={"live_shap": Section}, needs=("live_source",), names=names)

EXPLAIN = Step(
    name="explain_live",
    run="gpca.steps.live_shap",
    inputs={
        "registrations": "registrations/{source}/seed{*seed}.npz",
        "outcomes": "uncertainty/{source}/additive/seed{*seed}.npz",
    },
    outputs={"out": "live_shap/{source}/seed{*seed}.csv"},
    settings=("live_shap", "uncertainty.additive", "registrations.icp"),
    modules=lambda plan: [explainer_module(LOOKUP)],
    where={"source": "live_source", "seed": "live_seed"},
    when=lambda plan: bool(plan.names["live_source"]),
)


@numbers("live_shap.csv", rule="live_shap_metrics", paths="live_shap/{live_source}/seed{live_seed}.csv")
def collect(run: Run, paths: Paths) -> Frame:
    return read_all_metrics(paths)


@table(
    "IV-B Concept attribution accuracy",
    "SHAP by a live function",
    """Elsewhere SHAP reads the uncertainties of its coalitions from a table that was made beforehand. Here
    `shap.KernelExplainer` calls a function that perturbs the pair and registers it at each call. Both give the same
    Shapley values.""",
    needs=("live_source",),
    metrics="live_shap.csv",
)
def live_shap(run: Run, metrics: Frame) -> Table:
    sheet = TableBuilder("live_shap", {"source": "Dataset"})
    for (source,), labels in crossed(run.source_titles):
        rows = rows_where(metrics, source=source)
        samples = int(rows_where(rows, metric="test_samples")["value"].sum())
        cells = {
            name: cell_of_repeats(rows_where(rows, metric=name)["value"].to_numpy() * factor, samples)
            for name, (_, factor) in MEASURES.items()
        }
        sheet.add_row(labels, cells)
    return sheet.build(
        caption="shap's KernelExplainer on a function that registers, and on a table of its outcomes"
        + sheet.stand_in_clause(run.sources),
        column_head="measure",
        columns={name: column for name, (column, _) in MEASURES.items()},
        footnotes=(
            f"Means over {plural(sheet.most_seeds(), 'seed')}; n: its samples.",
            "Largest value, largest difference: of the Shapley values of a seed's samples. ICP calls: runs for one "
            "sample; live, those of the reference are counted too.",
        ),
    )
