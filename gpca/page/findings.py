"""The findings at the top of a run's page: sentences with the numbers of its files."""

from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from gpca.active_learning.curves import TABLE
from gpca.active_learning.settings import JUDGED_SHARE, rare_setting
from gpca.causes.judged import CEILING
from gpca.evaluation.intervals import TRIVIAL
from gpca.evaluation.measures import ALL, POOLED, read_rows
from gpca.experiments.cause_tables import lead
from gpca.experiments.diagnosis import JUDGED, TRAINED
from gpca.experiments.shifts import MEAN, reached
from gpca.explainers.gpca import GPCA_FORMS
from gpca.io.frame import Frame, Series
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.cells import rows_where
from gpca.reporting.words import plural

RULE = "rule"
PAPERS_RIVALS = {"shap_additive": "SHAP", "sa_local_additive": "sensitivity analysis"}
ON_FRAMES = {"dgcnn-none": "DGCNN without reduction", "gpca_pair": "GP-CA on the pair", RULE: "the untrained rule"}


class Finding(NamedTuple):
    """A number, a sentence or two about it, and the table with the details."""

    number: str
    text: str
    result: str


class Titles(NamedTuple):
    """Titles of explainers, of concepts with ``title`` and ``oracle``, and of causes; of shifts of the truth."""

    explainers: Mapping[str, Mapping]
    cause_explainers: Mapping[str, str]
    shifts: Mapping[str, str]
    budget: int


def findings_of(folder: Path, titles: Titles, shown: Collection[str]) -> list[Finding]:
    """Return the findings from the collected files in ``results/{run}`` whose results are shown."""
    readers: dict[str, Callable[[Frame, Titles], Iterator[Finding]]] = {
        "attribution_intervals.csv": _concepts,
        "cause_intervals.csv": _causes,
        "shifts.csv": _shifts,
        "real_world_intervals.csv": _frames,
        "active_learning.csv": _labels,
        "recovery_intervals.csv": _recovery,
    }
    findings: list[Finding] = []
    for name, find in readers.items():
        if (folder / name).is_file():
            findings += find(read_rows(folder / name), titles)
    return [finding for finding in findings if finding.result in shown]


def _concepts(intervals: Frame, titles: Titles) -> Iterator[Finding]:
    rows = intervals[(intervals["metric"] == "accuracy") & (intervals["concept"] == ALL)]
    by_dataset = {str(name): group for name, group in rows[rows["source"] != POOLED].groupby("method")}
    datasets = "of the test registrations, depending on the dataset (bounds of all 95 % intervals)"
    if RULE in by_dataset:
        text = (
            f"An untrained rule names the perturbed concept of the paper's protocol in {_range(by_dataset[RULE])} "
            f"{datasets}: turned by ICP, pose; points missing, overlap; otherwise noise. What a method adds is its "
            "lead over this rule."
        )
        yield Finding(_span(by_dataset[RULE]["value"]), text, "table1_extended")
    form = next((name for name in GPCA_FORMS if name in by_dataset), None)
    if form:
        others = {name: words for name, words in PAPERS_RIVALS.items() if name in by_dataset}
        rivals = "".join(f"; {words} in {_range(by_dataset[name])}" for name, words in others.items())
        text = (
            f"Under the paper's protocol, {titles.explainers[form]['title']} names it in {_range(by_dataset[form])} "
            f"{datasets}{rivals}. Guessing gives a third."
        )
        yield Finding(_span(by_dataset[form]["value"]), text, "table1_single_baselines")


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
        yield Finding(_percent(row["value"]), f"{lead(intervals, words)} {text}".lstrip(), "table9_causes")
    rows, trained = _pooled(intervals, titles, "regret")
    if trained and RULE in rows.index:
        best = min(trained, key=lambda name: rows.loc[name, "value"])
        left = _percent(rows.loc[best, "value"])
        text = (
            f"Removing the cause that the best explainer names first leaves {left} of the error of a failed "
            f"registration that removing the right one would take away ({_bounds(rows.loc[best])}; {words[best]}); the "
            f"untrained rule leaves {_percent(rows.loc[RULE, 'value'])} ({_bounds(rows.loc[RULE])})."
        )
        yield Finding(left, text, "table9_causes")


def _shifts(intervals: Frame, titles: Titles) -> Iterator[Finding]:
    rows = rows_where(intervals, metric="balanced_accuracy", method=JUDGED, against=TRAINED, concept=MEAN)
    if len(rows):
        number = f"{100 * rows['value'].iloc[0]:+.0f} points"
        verdict = reached(intervals, titles.shifts, titles.cause_explainers)
        yield Finding(number, f"{verdict} The truth is generated there in other ways than is learned.", "table9_shift")


def _pooled(intervals: Frame, titles: Titles, metric: str) -> tuple[Frame, list[str]]:
    """Return the rows of a metric for all sources together, by explainer, and the trained explainers."""
    rows = intervals[(intervals["metric"] == metric) & (intervals["against"] == "")]
    source = POOLED if (rows["source"] == POOLED).any() else next(iter(rows["source"]), POOLED)
    if source != POOLED and rows["source"].nunique() != 1:
        rows = rows[:0]
    rows = rows[rows["source"] == source].set_index("method")
    return rows, [name for name in titles.cause_explainers if name in rows.index and name not in TRIVIAL]


def _frames(intervals: Frame, titles: Titles) -> Iterator[Finding]:
    rows = intervals[(intervals["metric"] == "accuracy") & (intervals["concept"] == ALL)]
    rows = rows[rows["table"] == "attribution"].drop_duplicates("method").set_index("method")
    named = {name: words for name, words in ON_FRAMES.items() if name in rows.index}
    if named:
        parts = [f"{words} in {_bounded(rows.loc[name])}" for name, words in named.items()]
        text = f"On objects in depth frames, the perturbed concept is named by {'; '.join(parts)}."
        yield Finding(_percent(rows.loc[next(iter(named)), "value"]), text, "table6_backbones")


def _labels(metrics: Frame, titles: Titles) -> Iterator[Finding]:
    counts = {name: _labels_needed(metrics, name) for name in ("bald_kmeans", "random")}
    if all(counts.values()):
        text = (
            f"A concept that the classifier has never seen, {100 * JUDGED_SHARE:g} % of the pool, is known after "
            f"{counts['bald_kmeans']}, chosen by BALD with k-means; after {counts['random']}, chosen at random."
        )
        yield Finding(counts["bald_kmeans"], text, "table3_active_learning")


def _labels_needed(metrics: Frame, strategy: str) -> str:
    """Return how many labels the runs needed that reached the target, and how many of all did; empty without runs."""
    rows = metrics[(metrics["table"] == TABLE + rare_setting(JUDGED_SHARE)) & (metrics["method"] == strategy)]
    rows = rows[rows["concept"].isin(CONCEPTS)].set_index(["source", "concept", "seed"])
    to_target, reached, labels = (
        rows.loc[rows["metric"] == name, "value"] for name in ("labels_to_target", "reached", "labels")
    )
    known = to_target[reached == 1]
    if reached.empty:
        return ""
    if known.empty:
        return f"more than {labels.min():g} labels in each of {plural(len(reached), 'run')}"
    words = f"{known.min():g} to {known.max():g}" if known.min() < known.max() else f"{known.min():g}"
    return f"{words} labels in {len(known)} of {plural(len(reached), 'run')}"


def _recovery(intervals: Frame, titles: Titles) -> Iterator[Finding]:
    rows = intervals[(intervals["metric"] == f"recovered_within_{titles.budget}") & (intervals["concept"] == ALL)]
    rows = rows.drop_duplicates("method").set_index("method")
    if "gpca" not in rows.index:
        return
    fixed = rows[rows.index.str.startswith("sequence_")]["value"]
    named = {"random": "random actions", "oracle": "a policy that knows the cause"}
    named |= {fixed.idxmax(): "the best fixed sequence, in hindsight"} if len(fixed) else {}
    beside = [f"; {words} {_bounded(rows.loc[name])}" for name, words in named.items() if name in rows.index]
    text = (
        f"In a closed loop on rendered tables, GP-CA's policy repairs {_bounded(rows.loc['gpca'])} of the failed "
        f"registrations with at most {plural(titles.budget, 'action')}{''.join(beside)}."
    )
    yield Finding(_percent(rows.loc["gpca", "value"]), text, "table8_recovery")


def _range(rows: Frame) -> str:
    """Return the least and largest share over the datasets, and the bounds of all their intervals."""
    return f"{_span(rows['value'])} ({100 * rows['low'].min():.0f} to {100 * rows['high'].max():.0f})"


def _bounded(row: Mapping) -> str:
    return f"{_percent(row['value'])} ({_bounds(row)})"


def _bounds(row: Mapping) -> str:
    return f"{100 * row['low']:.0f} to {100 * row['high']:.0f}"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _span(shares: Series) -> str:
    low, high = (f"{100 * share:.0f}" for share in (shares.min(), shares.max()))
    return f"{low} %" if low == high else f"{low} to {high} %"
