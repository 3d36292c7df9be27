"""SHAP by a live function: whether a table of outcomes, computed beforehand, gives the values that shap finds."""

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
from gpca.reporting.sheet import Sheet, crossed, mean_over_seeds, show
from gpca.reporting.tables.table import Table
from gpca.reporting.words import plural
from gpca.settings import Bounds, Count
from gpca.steps.live_shap import LOOKUP

PLAIN: dict[str, Any] = {"interval": False, "limits": (0, inf)}
COUNT = PLAIN | {"decimals": 0, "factor": 1}
COLUMNS = {
    "largest_value": show("largest_value", "Largest value (nats)", decimals=3, factor=1, **PLAIN),
    "largest_difference": show("largest_difference", "Largest difference (10⁻⁹ nats)", decimals=3, factor=1e9, **PLAIN),
    "named_alike": show("named_alike", "Named alike (%)", interval=False),
    "live_icp_calls": show("live_icp_calls", "ICP calls, live", **COUNT),
    "icp_calls": show("icp_calls", "ICP calls, table", **COUNT),
    "test_samples": show("test_samples", "n", **COUNT),
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
    rows = crossed(("source", run.source_titles))
    sheet = Sheet("live_shap", {"source": "Dataset"}, rows, COLUMNS, metrics, cell=mean_over_seeds)
    caption = "shap's KernelExplainer on a function that registers, and on a table of its outcomes"
    notes = (
        f"Means over {plural(sheet.seeds, 'seed')}; n: its samples.",
        "Largest value, largest difference: of the Shapley values of a seed's samples. ICP calls: runs for one "
        "sample; live, those of the reference are counted too.",
    )
    return sheet.table(caption + sheet.stand_in_clause(run.sources), "measure", notes, keep_empty=True)
