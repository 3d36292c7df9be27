"""Sentences on who leads: re-enactment without training, or the best explainer that is trained and reads none."""

from collections.abc import Collection, Mapping

from gpca.causes.judged import CEILING
from gpca.evaluation.intervals import FEWEST_CLUSTERS, FEWEST_FAILURES, WITHOUT_TRAINING
from gpca.evaluation.measures import POOLED
from gpca.explainers.registry import CAUSES, explainers
from gpca.io.frame import Frame
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.cells import rows_where

TRAINED = "trained"  # kind of differences: from the best explainer that is
JUDGED = "reenact"


def trained_rivals(name: str, names: Collection[str]) -> list[str]:
    """Rivals of what needs no training, and of all but the ceiling: who learns and reads no re-enactment."""
    entries = explainers(CAUSES)
    learned = [other for other in names if other in entries and other not in WITHOUT_TRAINING]
    return [other for other in learned if name != CEILING and "reenactment" not in entries[other].sees]


def lead(intervals: Frame, titles: Mapping[str, str]) -> str:
    """Sentence on the lead over all sources together, with titles of explainers; empty where no rows have it.

    Each dominant cause has a third of the failures.
    """
    rows = rows_where(intervals, method=JUDGED, source=POOLED).set_index(["against", "metric"], drop=False)
    if (TRAINED, "balanced_accuracy") not in rows.index:
        return ""
    nominal, failed = rows.loc[""].loc[["false_alarm_rate", "dominant_accuracy"], "samples"]
    row, fewest = rows.loc[(TRAINED, "balanced_accuracy")], int(min(nominal, failed // len(CONCEPTS)))
    if fewest < FEWEST_FAILURES or row["clusters"] < FEWEST_CLUSTERS:
        counted = f"{fewest} samples of a kind and {row['clusters']:.0f} families"
        return f"Too little to conclude who leads: {counted} (it takes {FEWEST_FAILURES} and {FEWEST_CLUSTERS})."
    title, other = (titles[row[name]] for name in ("method", "other"))
    best = f"{other}, the best explainer that is trained and reads no re-enactment"
    value, low, high = 100 * row[["value", "low", "high"]].astype(float)
    least, most = sorted((abs(low), abs(high)))
    points = f"{abs(value):.1f} points of balanced accuracy ({least:.1f} to {most:.1f})"
    if high < 0:
        return f"{best}, leads {title} by {points}."
    if low > 0:
        return f"{title} leads {best}, by {points}."
    return f"{title} is not shown to lead {best}: {value:+.1f} points of balanced accuracy ({low:.1f} to {high:.1f})."
