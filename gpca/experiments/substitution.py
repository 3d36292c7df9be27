"""Explanations with other registration methods, and other estimators of uncertainty, than the paper's (Table XIV)."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gpca.alignment.methods.registry import installed, method_entry, method_module
from gpca.attribution.predictions import read_predictions
from gpca.declarations import EXPLAINERS, ByName, Experiment, Frame, LeftOut, Paths, Run, numbers, table
from gpca.declarations.step import Plan, Step, Wildcards
from gpca.errors import with_key
from gpca.evaluation.measures import ALL, POOLED, Clustered, Measure, by_value, over_seeds, per_seed, read_samples
from gpca.experiments.explained import explainer_settings, require_explained
from gpca.experiments.registration_methods import missing_methods
from gpca.explainers.registry import explainer_entry, explainer_module
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.sheet import Row, Sheet, Show, crossed, show, where
from gpca.settings import Distinct
from gpca.steps.exchange import ESTIMATOR, FAILURE, LABELS, ExchangeSettings, require_exchangeable
from gpca.uncertainty.estimators.registry import estimator_entry, estimator_module
from gpca.uncertainty.settings import MONTE_CARLO

ANOTHER = "another"  # all methods but the one that registered the training pairs
SAMPLE = ["explainer", "source", "seed", "split", "sample"]


@dataclass(frozen=True, kw_only=True)
class Section(ExchangeSettings):
    """The settings, the sources whose registrations are explained, and the explainers."""

    sources: Distinct[str]
    explainers: ByName


def check(config: dict, _left_out: LeftOut) -> None:
    for key, name in require_explained(config, "exchange.explainers"):
        with_key(key, require_exchangeable, name)


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    exchange = config["exchange"]
    return {
        "exchange_source": list(exchange["sources"]),
        "exchange_seed": list(config["seeds"])[: exchange["seeds"]],
        "exchange_estimated": [name for name in exchange["explainers"] if explainer_entry(name).design],
        "exchange_registered": [name for name in exchange["explainers"] if not explainer_entry(name).design],
        "exchange_method": installed(exchange["methods"]),
        "exchange_encoder": config["embedding"]["encoder"],
    }


EXPERIMENT = Experiment(
    name="substitution",
    sections={"exchange": Section},
    names=names,
    check=check,
    optional_entries={"exchange.explainers": EXPLAINERS},
    lists={f"exchange.{name}": name for name in ("sources", "methods", "estimators")},
)


def _settings(plan: Plan, _wildcards: Wildcards) -> dict[str, Any]:
    config, exchange, methods = plan.config, plan.config["exchange"], plan.names["exchange_method"]
    sizes = {name: value for name, value in exchange.items() if name not in ("sources", "explainers")}
    return {
        "exchange": sizes | {"methods": methods},
        "explainers": explainer_settings(config, exchange["explainers"]),
        "methods": {name: config["methods"][name] for name in methods},
        "estimators": {name: config["estimators"][name] for name in exchange["estimators"]},
        "uncertainty": config["uncertainty"].get("additive", {}),
        "encoder": plan.encoder,
    }


EXPLAIN = Step(
    name="explain_exchanged",
    run="gpca.steps.exchange",
    inputs={
        "objects": "objects/{source}.npz",
        "registrations": "registrations/{source}/seed{*seed}.npz",
        "encoders": "encoders/{source}/{exchange_encoder}/seed{*seed}.pt",
    },
    outputs={"out": "exchange/{source}/seed{*seed}.csv"},
    settings=_settings,
    modules=lambda plan: [
        plan.encoder_module,
        *map(explainer_module, plan.config["exchange"]["explainers"]),
        *map(method_module, plan.names["exchange_method"]),
        *map(estimator_module, plan.config["exchange"]["estimators"]),
    ],
    where={"source": "exchange_source", "seed": "exchange_seed"},
    target="exchanges",
    priority=2,
)


def answers(files: Paths) -> Frame:
    """Predictions of all files, and whether each is right (none without an estimate), and the same as Monte-Carlo's."""
    rows = read_samples(files, lambda path: read_predictions(path, (*LABELS, FAILURE)), ("source",))
    named = rows.set_index(SAMPLE)["concept_predicted"]
    usual_N = named[(rows["asked_of"] == MONTE_CARLO).to_numpy()].reindex(named.index).to_numpy()
    failed_N = rows[FAILURE] != ""
    return rows.assign(
        table=rows["explainer"],
        method=rows["asked_of"],
        right=(rows["concept_true"] == rows["concept_predicted"]) & ~rows["abstained"],
        failed=failed_N,
        silent=rows["abstained"] & ~failed_N,
        agrees=rows["concept_predicted"] == usual_N,
        cluster=rows["source"] + "/" + rows["cluster"],
    )


def measured(rows: Frame) -> Iterator[tuple[Frame, Any, dict[str, Measure]]]:
    """Samples, their parts and measures: of each explainer and estimator, or of each that learned from one method."""
    import pandas as pd

    by_estimator = {
        "accuracy": Measure("right"),
        "no_estimate": Measure("failed", only=(ALL,)),
        "abstained": Measure("silent", only=(ALL,)),
    }
    if (rows["asked_of"] == MONTE_CARLO).any():
        by_estimator["agreement"] = Measure("agrees", only=(ALL,))
    by_method = {"accuracy": Measure("right"), "failed": Measure("failed")}
    for (exchanged, _), explained in rows.groupby(["exchanged", "explainer"], sort=False):
        for learnt_from, subset in explained.groupby("learnt_from", sort=False):
            if exchanged == ESTIMATOR:
                yield subset, lambda rows: by_value(rows, "concept_true", rows["concept_true"].unique()), by_estimator
                continue
            others = subset[subset["asked_of"] != learnt_from].assign(method=ANOTHER)
            both = pd.concat([subset, others]) if subset["asked_of"].nunique() > 1 else subset
            yield both, lambda rows: {rows["learnt_from"].iloc[0]: np.ones(len(rows), bool)}, by_method


@numbers(
    "exchange.csv",
    "exchange_intervals.csv",
    rule="exchange_metrics",
    files="exchange/{exchange_source}/seed{exchange_seed}.csv",
)
def collect(run: Run, files: Paths) -> tuple[Frame, Frame]:
    """Measures by seed, and over all sources and seeds with intervals over families of objects.

    ``table`` is the explainer. For one that reads an uncertainty, ``method`` is the estimator and ``concept`` a
    concept. For another one, ``method`` registered the test pairs, or is `ANOTHER`, and ``concept`` the training pairs.
    """
    import pandas as pd

    rows = answers(files)
    draws = Clustered.drawn(rows["seed"], rows["cluster"], "exchange intervals")
    parts_of_files = [subset for _, subset in rows.groupby(["source", "seed"], sort=False)]
    return (
        pd.concat([per_seed(*each) for subset in parts_of_files for each in measured(subset)], ignore_index=True),
        pd.concat([over_seeds(*each, draws) for each in measured(rows.assign(source=POOLED))], ignore_index=True),
    )


SECTION = "Beyond the paper: explanations with another method or estimator"
BY_CONCEPT = {part: show("accuracy", part.capitalize(), part) for part in (ALL, *CONCEPTS)}
ANSWERED = {
    "agreement": show("agreement", "As with Monte-Carlo"),
    "abstained": show("abstained", "Abstained", interval=False),
    "no_estimate": show("no_estimate", "No estimate", interval=False),
}


@table(
    SECTION,
    "Table XIV: explanations by every estimator",
    """SHAP, sensitivity analysis and residuals as in Table I, with each estimator's covariance in place of
    Monte-Carlo's, on the same test samples. If the rows of an explainer are alike, its answer does not depend on
    the estimator. An estimator that reads no start assigns no value to pose errors.""",
    needs=("exchange_estimated",),
    intervals="exchange_intervals.csv",
)
def table14_estimator_explanations(run: Run, intervals):
    exchange, heads = run.config["exchange"], {"explainer": "Explainer", "estimator": "Uncertainty by"}
    explainers = run.titles(explainer_entry, exchange["explainers"])
    rows = crossed(("table", explainers), ("method", run.titles(estimator_entry, exchange["estimators"])))

    def blank(row: Row, key: str) -> bool:
        return key == "agreement" and row.where["method"] == MONTE_CARLO  # with itself

    sheet = Sheet("table14_estimator_explanations", heads, rows, BY_CONCEPT | ANSWERED, intervals, blank=blank)
    return sheet.table(
        "Accuracy (%) with each estimator in place of Monte-Carlo" + run.stand_ins(exchange["sources"]),
        "metric",
        (
            f"{sheet.over()}. Shares of {sheet.samples(ALL)} test samples of all datasets together, "
            f"{sheet.samples(*CONCEPTS)} of each concept. Bold: best of an explainer.",
            "As with Monte-Carlo: share of the samples with the same answer. Abstained: all concepts have the same "
            "value. No estimate: the estimator failed under a condition, and the sample counts as wrong.",
        ),
        bold=[ALL],
        same=1,
    )


@table(
    SECTION,
    "Table XIV: from each registration method to each other",
    """GP-CA trained on registrations by one method (rows) and asked about the same pairs registered by another
    (columns). The first row and column are the paper's ICP.""",
    needs=("exchange_registered",),
    intervals="exchange_intervals.csv",
)
def table14_method_matrix(run: Run, intervals):
    exchange = run.config["exchange"]
    methods = run.titles(method_entry, installed(exchange["methods"]))
    asked = {name: f"on {title}" for name, title in methods.items()} | {ANOTHER: "on another (mean)"}
    columns = {name: Show(title, where={"metric": "accuracy", "method": name}) for name, title in asked.items()}
    heads = {"explainer": "Explainer", "learnt_from": "Learned from"}
    rows = crossed(("table", run.titles(explainer_entry, exchange["explainers"])), ("concept", methods))
    sheet = Sheet("table14_method_matrix", heads, rows, columns, intervals)
    failures = where(intervals, {"metric": "failed"} | dict(sheet.rows[0].where)).set_index("method")["value"]
    failed = [f"{title} {100 * failures[name]:.1f} %" for name, title in methods.items() if name in failures]
    return sheet.table(
        "Accuracy (%) from each registration method to each other" + run.stand_ins(exchange["sources"]),
        "asked_of",
        (
            f"{sheet.over()}. Shares of {sheet.samples(next(iter(methods)))} test samples of all datasets together. "
            "Bold: best on a method.",
            "The explainer learns from registrations by one method and explains the same test pairs as registered by "
            "another; the encoder is the run's own, which has seen point-to-point alone.",
            "Registrations that failed by the method's own account, which are explained like any other: "
            f"{', '.join(failed)}.",
            *missing_methods(exchange["methods"]),
        ),
        bold=methods,
        same=1,
    )
