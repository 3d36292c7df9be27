"""The findings at the top of a run's page: sentences with the numbers of its files."""

from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gpca.active_learning.curves import TABLE
from gpca.active_learning.settings import JUDGED_SHARE, rare_setting
from gpca.causes.judged import CEILING
from gpca.evaluation.intervals import TRIVIAL
from gpca.evaluation.measures import ALL, POOLED, read_clustered, read_metrics
from gpca.experiments.frames import read_together
from gpca.explainers.gpca import GPCA_FORMS
from gpca.io.frame import Frame
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.words import plural

RULE = "rule"
PAPERS_RIVALS = {"shap_additive": "SHAP", "sa_local_additive": "sensitivity analysis"}


class Finding(NamedTuple):
    """A number, a sentence or two about it, and the table with the details."""

    number: str
    text: str
    result: str


class Titles(NamedTuple):
    """Titles of explainers: of concepts with ``title`` and ``oracle``, and of causes."""

    explainers: Mapping[str, Mapping]
    cause_explainers: Mapping[str, str]
    budget: int


def findings_of(folder: Path, titles: Titles, shown: Collection[str]) -> list[Finding]:
    """Return the findings from the collected files in ``results/{run}`` whose results are shown."""
    readers: dict[str, tuple[Callable, Callable[[Frame, Titles], Iterator[Finding]]]] = {
        "metrics.csv": (read_metrics, _concepts),
        "cause_intervals.csv": (read_clustered, _causes),
        "real_world.csv": (read_together, _frames),
        "active_learning.csv": (read_metrics, _labels),
        "recovery.csv": (read_metrics, _recovery),
    }
    findings: list[Finding] = []
    for name, (read, find) in readers.items():
        if (folder / name).is_file():
            findings += find(read(folder / name), titles)
    return [finding for finding in findings if finding.result in shown]


def _concepts(metrics: Frame, titles: Titles) -> Iterator[Finding]:
    accuracies = _accuracies(metrics)
    if RULE in accuracies:
        text = (
            "An untrained rule names the perturbed concept of the paper's protocol in "
            f"{_span(accuracies[RULE])} of the test registrations, depending on the dataset: turned by ICP, pose; "
            "points missing, overlap; otherwise noise. What a method adds is its lead over this rule."
        )
        yield Finding(_span(accuracies[RULE]), text, "table1_extended")
    forms = {name: accuracies[name].mean() for name in GPCA_FORMS if name in accuracies}
    if forms:
        span = _span(accuracies[next(iter(forms))])
        rivals = [f"{words} {_span(accuracies[name])}" for name, words in PAPERS_RIVALS.items() if name in accuracies]
        text = (
            f"Under the paper's protocol, GP-CA names the perturbed concept in {span} of the test registrations, "
            f"depending on the dataset{''.join(f'; {rival}' for rival in rivals)}. Guessing gives a third."
        )
        yield Finding(span, text, "table1_single_baselines")
    others = {
        name: accuracies[name].mean()
        for name, entry in titles.explainers.items()
        if name in accuracies and not entry["oracle"] and name not in GPCA_FORMS and name not in TRIVIAL
    }
    if forms and others:
        best, best_form = max(others, key=others.__getitem__), max(forms, key=forms.__getitem__)
        text = (
            f"{titles.explainers[best]['title']} comes first among the {len(others)} other explainers without access "
            f"to the truth, with {_percent(others[best], 1)} on average over the datasets, where "
            f"{titles.explainers[best_form]['title']} has {_percent(forms[best_form], 1)}."
        )
        yield Finding(_percent(others[best], 1), text, "table1_extended")
    gpca = next((name for name in GPCA_FORMS if (metrics["method"] == name).any()), None)
    rows = metrics[(metrics["method"] == gpca) & (metrics["concept"] == ALL)]
    counts = rows[rows["metric"].isin(("causal_samples", "test_samples"))].groupby("metric")["value"].sum()
    if len(counts) == 2:
        share = _percent(counts["causal_samples"] / counts["test_samples"])
        text = (
            f"{share} of these registrations are more uncertain than 95 % of clean pairs. The labels of the protocol "
            "say what was perturbed, not whether that did any harm."
        )
        yield Finding(share, text, "table1_extended")


def _causes(intervals: Frame, titles: Titles) -> Iterator[Finding]:
    words = titles.cause_explainers
    rows, trained = _pooled(intervals, titles, "balanced_accuracy")
    if trained:
        best = max(trained, key=lambda name: rows.loc[name, "value"])
        row = rows.loc[best]
        text = (
            "Where the truth is measured, on objects that no explainer has seen, the best tells nominal registrations "
            f"and the dominant causes of failed ones apart with a balanced accuracy of {_percent(row['value'])} "
            f"(95 % interval {_bounds(row)} %): {words[best]}."
        )
        gains = intervals[(intervals["metric"] == "balanced_accuracy") & (intervals["against"] == "trivial")]
        for gain in gains[(gains["source"] == row["source"]) & (gains["method"] == best)].to_dict("records"):
            if gain["other"] in words:
                text += (
                    f" The best trivial rival, {words[gain['other']]}, is {100 * gain['value']:.0f} points behind "
                    f"({_bounds(gain)})."
                )
        if "gpca" in trained and best != "gpca":
            text += f" {words['gpca']} has {_percent(rows.loc['gpca', 'value'])}."
        if CEILING in rows.index:
            text += f" The truth measured from other starts agrees in {_percent(rows.loc[CEILING, 'value'])}."
        yield Finding(_percent(row["value"]), text, "table9_causes")
    rows, trained = _pooled(intervals, titles, "regret")
    if trained and RULE in rows.index:
        best = min(trained, key=lambda name: rows.loc[name, "value"])
        left = _percent(rows.loc[best, "value"])
        text = (
            f"Removing the cause that the best explainer names first leaves {left} of the error of a failed "
            f"registration that removing the right one would take away ({words[best]}); the untrained rule leaves "
            f"{_percent(rows.loc[RULE, 'value'])}."
        )
        yield Finding(left, text, "table9_causes")


def _pooled(intervals: Frame, titles: Titles, metric: str) -> tuple[Frame, list[str]]:
    """Return the rows of a metric for all sources together, by explainer, and the trained explainers."""
    rows = intervals[(intervals["metric"] == metric) & (intervals["against"] == "")]
    source = POOLED if (rows["source"] == POOLED).any() else next(iter(rows["source"]), POOLED)
    if source != POOLED and rows["source"].nunique() != 1:
        rows = rows[:0]
    rows = rows[rows["source"] == source].set_index("method")
    return rows, [name for name in titles.cause_explainers if name in rows.index and name not in TRIVIAL]


def _frames(metrics: Frame, titles: Titles) -> Iterator[Finding]:
    # Names are of backbone and reduction.
    if means := [accuracies.mean() for name, accuracies in _accuracies(metrics).items() if "-" in name]:
        span = _span(np.array(means))
        text = f"On objects in depth frames, GP-CA is right in {span} of the cases, depending on encoder and reduction."
        yield Finding(span, text, "table6_backbones")


def _labels(metrics: Frame, titles: Titles) -> Iterator[Finding]:
    bald, random = (_median_labels(metrics, name) for name in ("bald_kmeans", "random"))
    if bald and random:
        text = (
            f"A concept that the classifier has never seen, {100 * JUDGED_SHARE:g} % of the pool, is known after "
            f"{bald} chosen by BALD and k-means, and after {random} drawn at random (medians)."
        )
        yield Finding(bald, text, "table3_active_learning")


def _recovery(metrics: Frame, titles: Titles) -> Iterator[Finding]:
    rows = metrics[(metrics["metric"] == f"recovered_within_{titles.budget}") & (metrics["concept"] == ALL)]
    shares = {name: _percent(share) for name, share in rows.groupby("method")["value"].mean().items()}
    if "gpca" in shares:
        others = {"random": "random actions", "oracle": "a policy that knows the cause"}
        beside = "".join(f"; {words} {shares[name]}" for name, words in others.items() if name in shares)
        text = (
            f"In a closed loop on rendered tables, GP-CA's policy repairs {shares['gpca']} of the failed "
            f"registrations with at most {plural(titles.budget, 'action')}{beside}."
        )
        yield Finding(shares["gpca"], text, "table8_recovery")


def _accuracies(metrics: Frame) -> dict[str, np.ndarray]:
    """Return method -> mean accuracy over the seeds, by source."""
    rows = metrics[(metrics["metric"] == "accuracy") & (metrics["concept"] == ALL)]
    means = rows.groupby(["method", "source"])["value"].mean()
    return {str(method): accuracies.to_numpy() for method, accuracies in means.groupby(level="method")}


def _median_labels(metrics: Frame, strategy: str) -> str | None:
    """Return the median number of labels over datasets and seeds, in words; a lower bound if it is censored."""
    rows = metrics[(metrics["table"] == TABLE + rare_setting(JUDGED_SHARE)) & (metrics["method"] == strategy)]
    rows = rows[rows["concept"].isin(CONCEPTS)].set_index(["source", "concept", "seed"])
    to_target, reached, labels = (
        rows.loc[rows["metric"] == name, "value"] for name in ("labels_to_target", "reached", "labels")
    )
    if reached.empty:
        return None
    median = float(np.median(np.where(reached == 1, to_target, np.inf)))
    return f"{median:g} labels" if np.isfinite(median) else f"more than {labels.median():g} labels"


def _bounds(row: Mapping) -> str:
    return f"{100 * row['low']:.0f} to {100 * row['high']:.0f}"


def _percent(share: float, decimals: int = 0) -> str:
    return f"{100 * share:.{decimals}f} %"


def _span(shares: np.ndarray) -> str:
    low, high = (f"{100 * share:.0f}" for share in (shares.min(), shares.max()))
    return f"{low} %" if low == high else f"{low} to {high} %"
