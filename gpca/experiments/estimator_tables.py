"""Tables of the estimators of a pose's covariance: by what they model, by every reference, as alarms (Table XII)."""

from __future__ import annotations

from math import inf
from typing import Any

from gpca.alignment.methods.registry import method_entry
from gpca.declarations.plan import Run
from gpca.declarations.result import Frame, table
from gpca.evaluation.intervals import REPEATS
from gpca.experiments import estimators
from gpca.reporting.tables.builder import TableBuilder, crossed
from gpca.reporting.tables.cells import interval_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column
from gpca.reporting.words import plural
from gpca.uncertainty.estimates import KINDS

SECTION = "Beyond the paper: how uncertain a pose is"
INTERVALS = {"intervals": (estimators.read_intervals, "estimator_intervals.csv")}
REFERENCES = {"starts": "Other starts", "data": "Other data", "all": "Other starts and data"}
# By which an estimator is judged, by what it models. No posterior can be drawn here; a right one is about as wide as
# the results of other data.
REFERENCE_OF = {"starts": "starts", "data": "data", "posterior": "data", "starts and data": "all", "error": "all"}
KL: dict[str, Any] = {"limits": (0, inf), "least_is_best": True}
RATIO: dict[str, Any] = {"interval": False, "limits": (0, inf)}
BY_MODEL = {  # Each of these metrics has a column, by the reference of what an estimator models.
    "kl_rotation": Column("KL, rotation (nats)", 1, heavy_tail=True, **KL),
    "kl_translation": Column("KL, translation (nats)", 1, heavy_tail=True, **KL),
    "nne": Column("NNE", 2, **RATIO),
    "nees": Column("NEES / 6", 1, **RATIO),
    "coverage": Column("Coverage (%)"),
}
BY_TRUTH = {
    f"nees_{estimators.TRUTH}": Column("True pose: NEES / 6", 1, **RATIO),
    f"coverage_{estimators.TRUTH}": Column("True pose: coverage (%)"),
}


def _methods(run: Run) -> dict[str, str]:
    return run.titles(method_entry, run.config["estimator_pairs"]["methods"])


def _values(intervals: Frame, method: str, state: str, name: str) -> Frame:
    return rows_where(intervals, method=method, state=state, estimator=name).set_index("metric")


def _cell(values: Frame, metric: str) -> Cell | None:
    if metric not in values.index:
        return None
    return interval_cell(values.loc[metric], factor=100 if metric.startswith("coverage") else 1)


def _count(values: Frame, metric: str) -> Cell | None:
    counted = _cell(values, metric)
    return counted and plain_cell(float(counted.test_samples), counted.seeds, counted.test_samples)


@table(
    SECTION,
    "Table XII: estimators of uncertainty",
    """What each estimator says about the same registrations, judged by what it models. A reference is a set of further
    registrations of the same situation: from other starts, of other data (the surfaces sampled again, with other
    noise and other outliers), or both. The paper uses Monte-Carlo over the starts alone. Registrations that failed
    stand apart. Learners are also trained on another dataset and with mild severities.""",
    **INTERVALS,
)
def table12_uncertainty(run: Run, intervals):
    heads = {"method": "Registered by", "state": "State", "estimator": "Estimator", "models": "Models"}
    builder = TableBuilder("table12_uncertainty", heads)
    methods, entries = _methods(run), estimators.estimates(run.config, run.sources)
    for (method, state), labels in crossed(methods, {estimators.SUCCEEDED: "Succeeded", estimators.FAILED: "Failed"}):
        for name, entry in entries.items():
            models = entry["models"]
            values = _values(intervals, method, state, name)
            cells = {metric: _cell(values, f"{metric}_{REFERENCE_OF[models]}") for metric in BY_MODEL}
            cells |= {metric: _cell(values, metric) for metric in BY_TRUTH}
            cells["samples"] = _count(values, f"coverage_{estimators.TRUTH}")
            builder.add_row([*labels, (name, entry["title"]), (models, models)], cells)
    builder.compare_down(("kl_rotation", "kl_translation"), same=2)
    refused = []
    for method, title in methods.items():
        for name, entry in entries.items():
            if set(rows_where(intervals, method=method, estimator=name)["metric"]) == {"no_estimate"}:
                refused.append(f"{entry['title']}, of {title}")
    return builder.build(
        caption="What estimators say of the covariance of a pose, by what they model" + run.stand_ins(),
        column_head="metric",
        columns={"samples": Column("n", 0, **RATIO), **BY_MODEL, **BY_TRUTH},
        footnotes=(
            f"n: registrations with an estimate, of all datasets and {plural(builder.most_seeds(), 'seed')}. In "
            f"brackets: the 95 % interval of a bootstrap over families of objects and seeds ({REPEATS} draws); of a "
            "divergence it is left out where it is wider than the value, and the CSV holds it. Failed: an error of "
            f"{100 * run.config['success']['error']:g} % of the diameter or more.",
            f"Each estimator is judged by {run.config['estimator_pairs']['repeats']} further registrations, between "
            "which varies what it models: other starts; other data, which is the surface sampled again with other "
            "noise and other outliers; or both, also for one that models the error. A posterior is judged by other "
            "data, as a right one is about as wide as the results of these.",
            "KL: from the covariance of those results. NNE, NEES / 6 and coverage: of those results about their mean. "
            "The first two are near 1 and the coverage is 95 % if the covariance is theirs; above 1, or below 95 %, an "
            "estimator is overconfident. KL, NNE and NEES are trimmed means (10 to 90 %). True pose: these of the "
            "error, which also has what moves all runs alike. Bold: least divergence of a method and state.",
            *([f"Left out, as they refuse every registration: {'; '.join(refused)}."] if refused else []),
        ),
    )


@table(
    SECTION,
    "Table XII, every reference",
    """Every estimator against every kind of reference, and the references against each other and against the error.
    Whatever no repetition sees is wrong in all of them alike, such as the bias by a surface that is missing.""",
    **INTERVALS,
)
def table12_references(run: Run, intervals):
    heads = {"method": "Registered by", "estimator": "Estimator", "models": "Models"}
    builder = TableBuilder("table12_references", heads)
    columns = {}
    for kind in KINDS:
        columns[f"kl_rotation_{kind}"] = Column(f"{REFERENCES[kind]}: KL, rotation", 1, interval=False, **KL)
        columns[f"coverage_{kind}"] = Column(f"{REFERENCES[kind]}: coverage (%)")
    columns[f"coverage_{estimators.TRUTH}"] = Column("True pose: coverage (%)")
    references = {
        f"reference_{kind}": {"title": f"Reference: {title.lower()}", "models": "–"}
        for kind, title in REFERENCES.items()
    }
    for method, title in _methods(run).items():
        for name, entry in (references | estimators.estimates(run.config, run.sources)).items():
            values = _values(intervals, method, estimators.SUCCEEDED, name)
            own = name.replace("reference_", "kl_rotation_")  # of a reference from itself
            cells = {metric: _cell(values, metric) for metric in columns if metric != own}
            labels = [(method, title), (name, entry["title"]), (entry["models"], entry["models"])]
            builder.add_row(labels, cells, rival=name not in references)
    builder.compare_down([metric for metric in columns if metric.startswith("kl_")], same=1)
    return builder.build(
        caption="Estimators against every kind of reference, registrations that succeeded" + run.stand_ins(),
        column_head="metric",
        columns=columns,
        footnotes=(
            f"Each reference: {run.config['estimator_pairs']['repeats']} registrations of the same situation, with "
            "other starts, other data, or both. KL in nats, coverage and intervals are as in Table XII. Bold: least "
            "divergence of a method, the references apart. The references' own rows say how much of the error each "
            "kind of repetition sees.",
        ),
    )


@table(
    SECTION,
    "Table XII, as an alarm",
    """Whether the spread that an estimator predicts tells registrations that failed from the others, and by how much
    better than the best gate, which needs no estimator.""",
    **INTERVALS,
    seconds=(estimators.collect_estimate_seconds, "timings/{source}/estimator_{estimate}/seed{seed}.csv"),
)
def table12_failures(run: Run, intervals, seconds):
    builder = TableBuilder("table12_failures", {"method": "Registered by", "estimator": "Estimator"})
    entries = estimators.estimates(run.config, run.sources)
    titles = {name: entry["title"] for name, entry in entries.items()} | estimators.GATES
    for method, method_title in _methods(run).items():
        counted = rows_where(intervals, method=method, metric="no_estimate").groupby("state")["samples"].max()
        counts = ", ".join(
            f"{int(counted.get(state, 0))} {state}" for state in (estimators.SUCCEEDED, estimators.FAILED)
        )
        for name, title in titles.items():
            values = _values(intervals, method, estimators.BOTH, name)
            cells = {metric: _cell(values, metric) for metric in ("auroc_failed", "spearman_error")}
            if "auroc_failed" in values.index:
                row = values.loc["auroc_failed"]
                cells["lead"] = interval_cell(row, "difference", ("difference_low", "difference_high"), 1)
                cells["samples"] = _count(values, "auroc_failed")
                of_states = rows_where(intervals, method=method, estimator=name, metric="no_estimate")
                if total := int(of_states["samples"].sum()):
                    refused = sum(of_states["value"] * of_states["samples"])
                    cells["no_estimate"] = plain_cell(100 * refused / total, int(of_states["seeds"].iloc[0]), total)
            of_name = rows_where(seconds, estimator=name, method=method)["seconds"]
            if len(of_name) and cells.get("samples"):
                cells["milliseconds"] = plain_cell(1e3 * of_name.iloc[0], 1, len(of_name))
            builder.add_row([(method, f"{method_title}: {counts}"), (name, title)], cells)
    builder.compare_down(("auroc_failed", "spearman_error"), same=1)
    return builder.build(
        caption="Whether the predicted spread of a pose finds failed registrations" + run.stand_ins(),
        column_head="metric",
        columns={
            "samples": Column("n", 0, **RATIO),
            "auroc_failed": Column("AUROC of failed", 3, limits=(0, 1)),
            "lead": Column("Lead over the best gate", 3, limits=(-1, 1)),
            "spearman_error": Column("Spearman with the error", 2, interval=False, limits=(-1, 1)),
            "no_estimate": Column("None (%)", interval=False),
            "milliseconds": Column("ms", **RATIO),
        },
        footnotes=(
            "Spread: root mean square distance by which the points of the object would move. Lead: AUROC minus that of "
            "the best other gate (inlier RMSE, fitness, spread of Monte-Carlo's starts) on the same registrations and "
            "the same draws; an estimator tells more than a gate where the interval is above 0. Intervals as in Table "
            "XII. Spearman: of the spread and the error. Bold: best of a method.",
            "None: refused, or failed for a reason that the files name. ms: of one estimate, with descriptors, without "
            "learning; the one column that differs from run to run.",
        ),
    )
