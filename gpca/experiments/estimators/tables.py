"""Makes the tables of the estimators of a pose's covariance: by what they model, by every reference, as alarms."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.evaluation.intervals import REPEATS
from gpca.experiments.estimators.calibration import BOTH, FAILED, GATES, SUCCEEDED, TRUTH
from gpca.experiments.estimators.settings import KINDS, REFERENCE_OF
from gpca.objects.entry import stand_in_clause
from gpca.reporting.tables.builder import TableBuilder, crossed
from gpca.reporting.tables.cells import interval_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

STATES = {SUCCEEDED: "Succeeded", FAILED: "Failed"}
REFERENCES = {"starts": "Other starts", "data": "Other data", "all": "Other starts and data"}
_BY_MODEL = {  # Each of these metrics has a column, by the reference of what an estimator models.
    "kl_rotation": Column("KL, rotation (nats)", 1, limits=(0, inf), least_is_best=True, heavy_tail=True),
    "kl_translation": Column("KL, translation (nats)", 1, limits=(0, inf), least_is_best=True, heavy_tail=True),
    "nne": Column("NNE", 2, interval=False, limits=(0, inf)),
    "nees": Column("NEES / 6", 1, interval=False, limits=(0, inf)),
    "coverage": Column("Coverage (%)"),
}
_BY_TRUTH = {
    f"nees_{TRUTH}": Column("True pose: NEES / 6", 1, interval=False, limits=(0, inf)),
    f"coverage_{TRUTH}": Column("True pose: coverage (%)"),
}
_N = Column("n", 0, interval=False, limits=(0, inf))
_SHARES = ("coverage", "no_estimate")  # These are printed in %.


def table12_uncertainty(
    intervals: pd.DataFrame,
    sources: Mapping[str, Mapping],
    estimates: Mapping,
    methods: Mapping[str, str],
    pairs: Mapping,
) -> Table:
    """Return how each estimator fits the reference of what it models, and the error: methods × states × estimators.

    Args:
        intervals: What :func:`gpca.experiments.estimators.calibration.collect_intervals` returned.
        estimates: estimator -> its title, and what it models.
        pairs: The config's section ``estimator_pairs``.
    """
    heads = {"method": "Registered by", "state": "State", "estimator": "Estimator", "models": "Models"}
    table = TableBuilder("table12_uncertainty", heads)
    for (method, state), labels in crossed(methods, STATES):
        for name, entry in estimates.items():
            models = entry["models"]
            values = _values(intervals, method, state, name)
            of_model = {metric: f"{metric}_{REFERENCE_OF[models]}" for metric in _BY_MODEL}
            cells = {column: _cell(values, metric) for column, metric in (of_model | {m: m for m in _BY_TRUTH}).items()}
            cells["samples"] = _count(values, f"coverage_{TRUTH}")
            table.add_row([*labels, (name, entry["title"]), (models, models)], cells)
    table.compare_down(("kl_rotation", "kl_translation"), same=2)
    return table.build(
        caption="What estimators say of the covariance of a pose, by what they model"
        + stand_in_clause(sources.values()),
        column_head="metric",
        columns={"samples": _N, **_BY_MODEL, **_BY_TRUTH},
        footnotes=(
            f"n: registrations with an estimate, of all datasets and {plural(table.most_seeds(), 'seed')}. In "
            f"brackets: the 95 % interval of a bootstrap over families of objects and seeds ({REPEATS} draws); of a "
            "divergence it is left out where it is wider than the value, and the CSV holds it. Failed: an error of "
            f"{100 * pairs['failed']:g} % of the diameter or more.",
            f"Each estimator is judged by {pairs['repeats']} further registrations, between which varies what it "
            "models: other starts; other data, which is the surface sampled again with other noise and other outliers; "
            "or both, also for one that models the error. A posterior is judged by other data, as a right one is about "
            "as wide as the results of these.",
            "KL: from the covariance of those results. NNE, NEES / 6 and coverage: of those results about their mean. "
            "The first two are near 1 and the coverage is 95 % if the covariance is theirs; above 1, or below 95 %, an "
            "estimator is overconfident. KL, NNE and NEES are trimmed means (10 to 90 %). True pose: these of the "
            "error, which also has what moves all runs alike. Bold: least divergence of a method and state.",
            *_without(intervals, estimates, methods),
        ),
    )


def table12_references(
    intervals: pd.DataFrame,
    sources: Mapping[str, Mapping],
    estimates: Mapping,
    methods: Mapping[str, str],
    pairs: Mapping,
) -> Table:
    """Return every estimator against every reference, and the references against each other, where ICP succeeded."""
    table = TableBuilder(
        "table12_references", {"method": "Registered by", "estimator": "Estimator", "models": "Models"}
    )
    metrics = {f"{metric}_{kind}": metric for kind in KINDS for metric in ("kl_rotation", "coverage")}
    metrics |= {f"coverage_{TRUTH}": "coverage"}
    rows = {
        f"reference_{kind}": {"title": f"Reference: {title.lower()}", "models": "–"}
        for kind, title in REFERENCES.items()
    }
    for method, title in methods.items():
        for name, entry in (rows | dict(estimates)).items():
            values = _values(intervals, method, SUCCEEDED, name)
            own = {f"{metric}_{kind}" for kind in KINDS for metric in ("kl_rotation",) if name == f"reference_{kind}"}
            cells = {metric: _cell(values, metric) for metric in metrics if metric not in own}
            models = (entry["models"], entry["models"])
            table.add_row([(method, title), (name, entry["title"]), models], cells, rival=name not in rows)
    table.compare_down([metric for metric in metrics if metric.startswith("kl_")], same=1)
    titles = {"kl_rotation": "KL, rotation", "coverage": "coverage (%)"}
    columns = {
        metric: Column(
            f"{(REFERENCES | {TRUTH: 'True pose'})[metric.removeprefix(f'{kept}_')]}: {titles[kept]}",
            1,
            interval=kept == "coverage",
            limits=(0, 100) if kept == "coverage" else (0, inf),
            least_is_best=kept != "coverage",
        )
        for metric, kept in metrics.items()
    }
    return table.build(
        caption="Estimators against every kind of reference, registrations that succeeded"
        + stand_in_clause(sources.values()),
        column_head="metric",
        columns=columns,
        footnotes=(
            f"Each reference: {pairs['repeats']} registrations of the same situation, with other starts, other data, "
            "or both. KL in nats, coverage and intervals are as in Table XII. Bold: least divergence of a method, the "
            "references apart. The references' own rows say how much of the error each kind of repetition sees.",
        ),
    )


def table12_failures(
    intervals: pd.DataFrame,
    seconds: pd.DataFrame,
    sources: Mapping[str, Mapping],
    estimates: Mapping,
    methods: Mapping[str, str],
) -> Table:
    """Return how well each estimator's spread finds failed registrations, beside gates that need no estimator."""
    table = TableBuilder("table12_failures", {"method": "Registered by", "estimator": "Estimator"})
    for method, title in methods.items():
        counted = rows_where(intervals, method=method, metric="no_estimate").groupby("state")["samples"].max()
        for name, entry in {**estimates, **{gate: {"title": words} for gate, words in GATES.items()}}.items():
            values = _values(intervals, method, BOTH, name)
            cells: dict[str, Cell | None] = {m: _cell(values, m) for m in ("auroc_failed", "spearman_error")}
            if "auroc_failed" in values.index:
                row = values.loc["auroc_failed"]
                cells["lead"] = interval_cell(row, "difference", ("difference_low", "difference_high"), 1)
                cells["samples"] = plain_cell(row["samples"], int(row["seeds"]), int(row["samples"]))
                parts = [_values(intervals, method, state, name) for state in STATES]
                cells["no_estimate"] = _refused(
                    [part.loc["no_estimate"] for part in parts if "no_estimate" in part.index]
                )
            of_name = rows_where(seconds, estimator=name, method=method)["seconds"]
            if len(of_name) and cells.get("samples"):
                cells["milliseconds"] = plain_cell(1e3 * of_name.iloc[0], 1, len(of_name))
            table.add_row([(method, f"{title}: {_counts(counted)}"), (name, entry["title"])], cells)
    table.compare_down(("auroc_failed", "spearman_error"), same=1)
    return table.build(
        caption="Whether the predicted spread of a pose finds failed registrations" + stand_in_clause(sources.values()),
        column_head="metric",
        columns={
            "samples": _N,
            "auroc_failed": Column("AUROC of failed", 3, limits=(0, 1)),
            "lead": Column("Lead over the best gate", 3, limits=(-1, 1)),
            "spearman_error": Column("Spearman with the error", 2, interval=False, limits=(-1, 1)),
            "no_estimate": Column("None (%)", interval=False),
            "milliseconds": Column("ms", interval=False, limits=(0, inf)),
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


def _values(intervals: pd.DataFrame, method: str, state: str, name: str) -> pd.DataFrame:
    return rows_where(intervals, method=method, state=state, estimator=name).set_index("metric")


def _cell(values: pd.DataFrame, metric: str) -> Cell | None:
    if metric not in values.index:
        return None
    return interval_cell(values.loc[metric], factor=100 if metric.startswith(_SHARES) else 1)


def _count(values: pd.DataFrame, metric: str) -> Cell | None:
    if metric not in values.index:
        return None
    row = values.loc[metric]
    return plain_cell(row["samples"], int(row["seeds"]), int(row["samples"]))


def _refused(rows: list[pd.Series]) -> Cell | None:
    """Return the share without an estimate over both states, in %."""
    total = int(sum(row["samples"] for row in rows))
    if not total:
        return None
    return plain_cell(100 * sum(row["value"] * row["samples"] for row in rows) / total, int(rows[0]["seeds"]), total)


def _counts(counted: pd.Series) -> str:
    return ", ".join(f"{int(counted.get(state, 0))} {state}" for state in (SUCCEEDED, FAILED))


def _without(intervals: pd.DataFrame, estimates: Mapping, methods: Mapping[str, str]) -> list[str]:
    """Return the footnote on the estimators that refuse every registration by a method, if there are any."""
    refused = [
        f"{entry['title']}, of {title}"
        for method, title in methods.items()
        for name, entry in estimates.items()
        if (rows := rows_where(intervals, method=method, estimator=name))["metric"].tolist().count("no_estimate")
        and set(rows["metric"]) == {"no_estimate"}
    ]
    return [f"Left out, as they refuse every registration: {'; '.join(refused)}."] if refused else []
