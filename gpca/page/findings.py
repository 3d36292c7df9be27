"""The findings at the top of a run's page: sentences with the numbers of its files."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.active_learning.curves import TABLE
from gpca.active_learning.settings import JUDGED_SHARE, rare_setting
from gpca.causes.judged import CEILING
from gpca.evaluation.intervals import UNTRAINED
from gpca.evaluation.measures import ALL, POOLED, read_clustered, read_metrics
from gpca.experiments.frames import read_together
from gpca.explainers.gpca import GPCA_FORMS
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

RULE = "rule"
PAPERS_RIVALS = {"shap_additive": "SHAP", "sa_local_additive": "sensitivity analysis"}


@dataclass(frozen=True)
class Finding:
    """A number, a sentence or two about it, and the table with the details."""

    number: str
    text: str
    result: str


@dataclass(frozen=True)
class Titles:
    """Titles of explainers: of concepts with ``title`` and ``oracle``, and of causes."""

    explainers: Mapping[str, Mapping]
    cause_explainers: Mapping[str, str]
    budget: int


def findings_of(folder: Path, titles: Titles, shown: Collection[str]) -> list[Finding]:
    """Return the findings from the collected files in ``results/{run}``, if their results are shown.

    Args:
        shown: names of the results.

    Raises:
        InputError: an unusable file.
    """
    readers: dict[str, tuple[Callable, list[Callable]]] = {
        "metrics.csv": (read_metrics, [_untrained, _protocol, _rival, _uncertain]),
        "cause_intervals.csv": (read_clustered, [_causes, _regret]),
        "real_world.csv": (read_together, [_frames]),
        "active_learning.csv": (read_metrics, [_labels]),
        "recovery.csv": (read_metrics, [_recovery]),
    }
    findings = []
    for name, (read, finders) in readers.items():
        if (folder / name).is_file():
            rows = read(folder / name)
            findings += [finding for find in finders if (finding := find(rows, titles))]
    return [finding for finding in findings if finding.result in shown]


def _untrained(metrics: pd.DataFrame, titles: Titles) -> Finding | None:
    accuracies = _accuracies(metrics)
    if RULE not in accuracies:
        return None
    span = _span(accuracies[RULE])
    text = (
        "An untrained rule names the perturbed concept of the paper's protocol in "
        f"{span} of the test registrations, depending on the dataset: turned by ICP, pose; points missing, overlap; "
        "otherwise noise. What a method adds is its lead over this rule."
    )
    return Finding(span, text, "table1_extended")


def _protocol(metrics: pd.DataFrame, titles: Titles) -> Finding | None:
    accuracies = _accuracies(metrics)
    gpca = next((name for name in GPCA_FORMS if name in accuracies), None)
    if gpca is None:
        return None
    rivals = [f"{words} {_span(accuracies[name])}" for name, words in PAPERS_RIVALS.items() if name in accuracies]
    text = (
        f"Under the paper's protocol, GP-CA names the perturbed concept in {_span(accuracies[gpca])} of the test "
        f"registrations, depending on the dataset{''.join(f'; {rival}' for rival in rivals)}. Guessing gives a third."
    )
    return Finding(_span(accuracies[gpca]), text, "table1_single_baselines")


def _rival(metrics: pd.DataFrame, titles: Titles) -> Finding | None:
    means = {name: accuracies.mean() for name, accuracies in _accuracies(metrics).items()}
    forms = {name: mean for name, mean in means.items() if name in GPCA_FORMS}
    others = {name: means[name] for name, entry in titles.explainers.items() if name in means and not entry["oracle"]}
    others = {name: mean for name, mean in others.items() if name not in forms and name not in UNTRAINED}
    if not forms or not others:
        return None
    best, best_form = max(others, key=others.__getitem__), max(forms, key=forms.__getitem__)
    text = (
        f"{titles.explainers[best]['title']} comes first among the {len(others)} other explainers without access to "
        f"the truth, with {_percent(others[best], 1)} on average over the datasets, where "
        f"{titles.explainers[best_form]['title']} has {_percent(forms[best_form], 1)}."
    )
    return Finding(_percent(others[best], 1), text, "table1_extended")


def _uncertain(metrics: pd.DataFrame, titles: Titles) -> Finding | None:
    gpca = next((name for name in GPCA_FORMS if (metrics["method"] == name).any()), None)
    rows = metrics[(metrics["method"] == gpca) & (metrics["concept"] == ALL)]
    counts = rows[rows["metric"].isin(("causal_samples", "test_samples"))].groupby("metric")["value"].sum()
    if len(counts) < 2:
        return None
    share = _percent(counts["causal_samples"] / counts["test_samples"])
    text = (
        f"{share} of these registrations are more uncertain than 95 % of clean pairs. The labels of the protocol "
        "say what was perturbed, not whether that did any harm."
    )
    return Finding(share, text, "table1_extended")


def _causes(intervals: pd.DataFrame, titles: Titles) -> Finding | None:
    rows, trained = _pooled(intervals, titles, "balanced_accuracy")
    if not trained:
        return None
    best = max(trained, key=lambda name: rows.loc[name, "value"])
    row = rows.loc[best]
    text = (
        "Where the truth is measured, on objects that no explainer has seen, the best tells nominal registrations and "
        f"the dominant causes of failed ones apart with a balanced accuracy of {_percent(row['value'])} "
        f"(95 % interval {_bounds(row)} %): {titles.cause_explainers[best]}."
    )
    gains = intervals[(intervals["metric"] == "balanced_accuracy") & (intervals["against"] == "untrained")]
    for gain in gains[(gains["source"] == row["source"]) & (gains["method"] == best)].to_dict("records"):
        if gain["other"] in titles.cause_explainers:
            text += (
                f" The best untrained rival, {titles.cause_explainers[gain['other']]}, is "
                f"{100 * gain['value']:.0f} points behind ({_bounds(gain)})."
            )
    if "gpca" in trained and best != "gpca":
        text += f" {titles.cause_explainers['gpca']} has {_percent(rows.loc['gpca', 'value'])}."
    if CEILING in rows.index:
        text += f" The truth measured from other starts agrees in {_percent(rows.loc[CEILING, 'value'])}."
    return Finding(_percent(row["value"]), text, "table9_causes")


def _regret(intervals: pd.DataFrame, titles: Titles) -> Finding | None:
    rows, trained = _pooled(intervals, titles, "regret")
    if not trained or RULE not in rows.index:
        return None
    best = min(trained, key=lambda name: rows.loc[name, "value"])
    text = (
        "Removing the cause that the best explainer names first leaves "
        f"{_percent(rows.loc[best, 'value'])} of the error of a failed registration that removing the right one would "
        f"take away ({titles.cause_explainers[best]}); the untrained rule leaves {_percent(rows.loc[RULE, 'value'])}."
    )
    return Finding(_percent(rows.loc[best, "value"]), text, "table9_causes")


def _pooled(intervals: pd.DataFrame, titles: Titles, metric: str) -> tuple[pd.DataFrame, list[str]]:
    """Return the rows of a metric for all sources together, by explainer, and the trained explainers."""
    rows = intervals[(intervals["metric"] == metric) & (intervals["against"] == "")]
    source = POOLED if (rows["source"] == POOLED).any() else next(iter(rows["source"]), POOLED)
    if source != POOLED and rows["source"].nunique() != 1:
        rows = rows[:0]
    rows = rows[rows["source"] == source].set_index("method")
    return rows, [name for name in titles.cause_explainers if name in rows.index and name not in UNTRAINED]


def _frames(metrics: pd.DataFrame, titles: Titles) -> Finding | None:
    accuracies = {name: of.mean() for name, of in _accuracies(metrics).items() if "-" in name}  # backbone-reduction
    if not accuracies:
        return None
    span = _span(np.array(list(accuracies.values())))
    text = f"On objects in depth frames, GP-CA is right in {span} of the cases, depending on encoder and reduction."
    return Finding(span, text, "table6_backbones")


def _labels(metrics: pd.DataFrame, titles: Titles) -> Finding | None:
    medians = {name: _median_labels(metrics, name) for name in ("bald_kmeans", "random")}
    bald, random = medians["bald_kmeans"], medians["random"]
    if bald is None or random is None:
        return None
    text = (
        f"A concept that the classifier has never seen, {100 * JUDGED_SHARE:g} % of the pool, is known after {bald} "
        f"chosen by BALD and k-means, and after {random} drawn at random (medians)."
    )
    return Finding(bald, text, "table3_active_learning")


def _recovery(metrics: pd.DataFrame, titles: Titles) -> Finding | None:
    rows = metrics[(metrics["metric"] == f"recovered_within_{titles.budget}") & (metrics["concept"] == ALL)]
    shares = rows.groupby("method")["value"].mean()
    if "gpca" not in shares:
        return None
    others = {"random": "random actions", "oracle": "a policy that knows the cause"}
    beside = [f"{words} {_percent(shares[name])}" for name, words in others.items() if name in shares]
    text = (
        f"In a closed loop on rendered tables, GP-CA's policy repairs {_percent(shares['gpca'])} of the failed "
        f"registrations with at most {plural(titles.budget, 'action')}{''.join(f'; {each}' for each in beside)}."
    )
    return Finding(_percent(shares["gpca"]), text, "table8_recovery")


def _accuracies(metrics: pd.DataFrame) -> dict[str, np.ndarray]:
    """Return method -> mean accuracy over the seeds, by source."""
    rows = metrics[(metrics["metric"] == "accuracy") & (metrics["concept"] == ALL)]
    means = rows.groupby(["method", "source"])["value"].mean()
    return {str(method): accuracies.to_numpy() for method, accuracies in means.groupby(level="method")}


def _median_labels(metrics: pd.DataFrame, strategy: str) -> str | None:
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
