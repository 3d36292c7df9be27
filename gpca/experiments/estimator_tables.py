"""Tables of the estimators of a pose's covariance: by what they model, by every reference, as alarms (Table XII)."""

from dataclasses import replace
from itertools import product
from math import inf
from typing import Any

from gpca.alignment.methods.registry import method_entry
from gpca.declarations import Frame, Run, table
from gpca.experiments import estimators
from gpca.reporting.sheet import Cell, Column, Row, Sheet, crossed, interval_cell, plain_cell, rows_where, with_label
from gpca.uncertainty.estimates import KINDS
from gpca.uncertainty.estimators.registry import estimator_entry

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


def _cell(values: Frame, metric: str) -> Cell | None:
    rows = rows_where(values, metric=metric)
    return interval_cell(rows.iloc[0], factor=100 if metric.startswith("coverage") else 1) if len(rows) else None


def _count(values: Frame, metric: str) -> Cell | None:
    counted = _cell(values, metric)
    return counted and plain_cell(float(counted.test_samples), counted.seeds, counted.test_samples)


@table(
    SECTION,
    "Table XII: estimators of uncertainty",
    """What each estimator says about the same registrations, judged by what it models: further registrations from other
    starts, as in the paper, of other data (the surfaces sampled again, with other noise and outliers), or both.""",
    **INTERVALS,
)
def table12_uncertainty(run: Run, intervals):
    heads = {"method": "Registered by", "state": "State", "estimator": "Estimator", "models": "Models"}
    methods, titles = _methods(run), run.titles(estimator_entry, run.config["estimators"])
    states = {estimators.SUCCEEDED: "Succeeded", estimators.FAILED: "Failed"}
    rows = crossed(("method", methods), ("state", states), ("estimator", titles))
    rows = with_label(rows, lambda row: estimator_entry(row.where["estimator"]).models)
    columns = {"samples": Column("n", 0, **RATIO), **BY_MODEL, **BY_TRUTH}

    def cells(row: Row, subset: Frame) -> dict[str, Cell | None]:
        reference = REFERENCE_OF[estimator_entry(row.where["estimator"]).models]
        by_reference = {metric: _cell(subset, f"{metric}_{reference}") for metric in BY_MODEL}
        samples = {"samples": _count(subset, f"coverage_{estimators.TRUTH}")}
        return by_reference | {metric: _cell(subset, metric) for metric in BY_TRUTH} | samples

    sheet = Sheet("table12_uncertainty", heads, rows, columns, intervals, more=cells)
    refused = [
        f"{title}, of {methods[method]}"
        for method, (name, title) in product(methods, titles.items())
        if set(rows_where(intervals, method=method, estimator=name)["metric"]) == {"no_estimate"}
    ]
    notes = (
        f"n: registrations with an estimate, of all datasets. {sheet.over()}; a divergence has no interval wider than "
        f"its value. Failed: an error of {100 * run.config['success']['error']:g} % of the diameter or more.",
        f"Each estimator is judged by {run.config['estimator_pairs']['repeats']} further registrations, between "
        "which varies what it models: other starts; other data; or both, also for one that models the error. A "
        "posterior is judged by other data, as a right one is about as wide as the results of these.",
        "KL: from the covariance of those results. NNE, NEES / 6 and coverage: of those results about their mean; "
        "NNE and NEES / 6 above 1, or coverage below 95 %, are overconfident. KL, NNE and NEES are trimmed means (10 "
        "to 90 %). True pose: these of the error. Bold: least divergence of a method and state.",
        *([f"Left out, as they refuse every registration: {'; '.join(refused)}."] if refused else []),
    )
    caption = "What estimators say of the covariance of a pose, by what they model" + run.stand_ins()
    return sheet.table(caption, "metric", notes, bold=("kl_rotation", "kl_translation"), same=2, keep_empty=True)


@table(
    SECTION,
    "Table XII, every reference",
    """Every estimator against every kind of reference, and the references against each other and against the error.
    Whatever no repetition sees is wrong in all of them alike, such as the bias by a surface that is missing.""",
    **INTERVALS,
)
def table12_references(run: Run, intervals):
    heads = {"method": "Registered by", "estimator": "Estimator", "models": "Models"}
    columns = {}
    for kind in KINDS:
        columns[f"kl_rotation_{kind}"] = Column(f"{REFERENCES[kind]}: KL, rotation", 1, interval=False, **KL)
        columns[f"coverage_{kind}"] = Column(f"{REFERENCES[kind]}: coverage (%)")
    columns[f"coverage_{estimators.TRUTH}"] = Column("True pose: coverage (%)")
    references = {f"reference_{kind}": f"Reference: {title.lower()}" for kind, title in REFERENCES.items()}
    models = dict.fromkeys(references, "–") | {name: estimator_entry(name).models for name in run.config["estimators"]}
    titles = references | run.titles(estimator_entry, run.config["estimators"])
    rows = crossed(("method", _methods(run)), ("estimator", titles))
    rows = with_label(rows, lambda row: models[row.where["estimator"]])
    rows = [replace(row, rival=row.where["estimator"] not in references) for row in rows]

    def cells(row: Row, subset: Frame) -> dict[str, Cell | None]:
        from_itself = row.where["estimator"].replace("reference_", "kl_rotation_")
        return {metric: _cell(subset, metric) for metric in columns if metric != from_itself}

    succeeded = rows_where(intervals, state=estimators.SUCCEEDED)
    sheet = Sheet("table12_references", heads, rows, columns, succeeded, more=cells)
    notes = (
        f"Each reference: {run.config['estimator_pairs']['repeats']} registrations. KL in nats; intervals as in Table "
        "XII. Bold: least divergence of a method, the references apart. Their own rows say how much of the error each "
        "kind of repetition sees.",
    )
    caption = "Estimators against every kind of reference, registrations that succeeded" + run.stand_ins()
    bold = [metric for metric in columns if metric.startswith("kl_")]
    return sheet.table(caption, "metric", notes, bold=bold, same=1, keep_empty=True)


@table(
    SECTION,
    "Table XII, as an alarm",
    """Whether the spread that an estimator predicts tells registrations that failed from the others, and by how much
    better than the best gate, which needs no estimator.""",
    **INTERVALS,
    seconds=(estimators.collect_estimate_seconds, "timings/{source}/estimator_{estimate}/seed{seed}.csv"),
)
def table12_failures(run: Run, intervals, seconds):
    titles = run.titles(estimator_entry, run.config["estimators"]) | estimators.GATES
    methods = {}
    for method, title in _methods(run).items():
        counts = rows_where(intervals, method=method, metric="no_estimate").groupby("state")["samples"].max()
        states = [f"{int(counts.get(state, 0))} {state}" for state in (estimators.SUCCEEDED, estimators.FAILED)]
        methods[method] = f"{title}: {', '.join(states)}"

    def cells(row: Row, subset: Frame) -> dict[str, Cell | None]:
        cells = {metric: _cell(subset, metric) for metric in ("auroc_failed", "spearman_error")}  # of both states
        if not len(areas := rows_where(subset, metric="auroc_failed")):
            return cells
        counted, spent = rows_where(subset, metric="no_estimate"), rows_where(seconds, **row.where)["seconds"]
        cells["lead"] = interval_cell(areas.iloc[0], "difference", ("difference_low", "difference_high"), 1)
        cells["samples"] = _count(subset, "auroc_failed")
        if total := int(counted["samples"].sum()):
            refused = sum(counted["value"] * counted["samples"])
            cells["no_estimate"] = plain_cell(100 * refused / total, int(counted["seeds"].iloc[0]), total)
        if len(spent):
            cells["milliseconds"] = plain_cell(1e3 * spent.iloc[0], 1, len(spent))
        return cells

    columns = {
        "samples": Column("n", 0, **RATIO),
        "auroc_failed": Column("AUROC of failed", 3, limits=(0, 1)),
        "lead": Column("Lead over the best gate", 3, limits=(-1, 1)),
        "spearman_error": Column("Spearman with the error", 2, interval=False, limits=(-1, 1)),
        "no_estimate": Column("None (%)", interval=False),
        "milliseconds": Column("ms", **RATIO),
    }
    rows = crossed(("method", methods), ("estimator", titles))
    heads = {"method": "Registered by", "estimator": "Estimator"}
    sheet = Sheet("table12_failures", heads, rows, columns, intervals, more=cells)
    notes = (
        "Spread: root mean square distance by which the points of the object would move. Lead: AUROC minus that of "
        "the best other gate (inlier RMSE, fitness, spread of Monte-Carlo's starts) on the same registrations and "
        "the same draws. Intervals as in Table XII. Spearman: of the spread and the error. Bold: best of a method.",
        "None: refused, or failed for a reason that the files name. ms: of one estimate, with descriptors, without "
        "learning; the one column that differs from run to run.",
    )
    caption = "Whether the predicted spread of a pose finds failed registrations" + run.stand_ins()
    return sheet.table(caption, "metric", notes, bold=("auroc_failed", "spearman_error"), same=1, keep_empty=True)
