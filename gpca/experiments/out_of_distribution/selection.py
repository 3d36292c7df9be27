"""Selects values of the tidy diagnostics for the tables of learners, and words the notes that all of them have."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from gpca.experiments.out_of_distribution.metrics import TABLE
from gpca.experiments.out_of_distribution.sets import DISTANCES, TRAINED_ON
from gpca.reporting.tables.builder import TableBuilder, interval_over
from gpca.reporting.tables.cells import rows_where
from gpca.reporting.words import in_words, plural

if TYPE_CHECKING:
    import pandas as pd

SHIFTED = {"severity": "severities beyond", "source": "unseen source", "objects": "unseen objects"}
RHO = f"rho_max_score_{DISTANCES[0]}"
OF_DISTANCE = (
    "ρ: Spearman's correlation of 1 - largest score with the distance to the training samples, the mean over the "
    "nearest ones in the space of the analytical features; diagnostics.csv has the other scores and distances."
)
AREA = "AURC: the area under the curve of risk over coverage, which is the mean risk; the paper's AUC."
CALIBRATION = "ECE: expected calibration error over 15 equally wide bins."


def only(metrics: pd.DataFrame, names: Iterable[str]) -> pd.DataFrame:
    """Return the rows of these metrics and of the numbers of samples, one in twenty, which are quicker to search."""
    return metrics[metrics["metric"].isin(["test_samples", *names])]


def values_by_seed(metrics: pd.DataFrame, source: str, learner: str, of_set: str, metric: str) -> pd.Series:
    """Return a learner's values of a metric on a set, by seed."""
    chosen = rows_where(metrics, table=TABLE + of_set, source=source, method=learner, metric=metric)
    return chosen.set_index("seed")["value"]


def printed_scale(metric: str) -> int:
    """Return the factor from a metric's unit to the printed one; only accuracies are printed in %."""
    return 100 if metric == "accuracy" else 1


def samples_of_seed(metrics: pd.DataFrame, source: str, of_set: str) -> int:
    """Return the test samples of a seed in a set, or in sets that are joined by '+'."""
    total = 0
    for name in of_set.split("+"):
        counted = rows_where(metrics, table=TABLE + name, source=source, metric="test_samples")
        total += int(counted["value"].max())
    return total


def repeats_note(table: TableBuilder, metrics: pd.DataFrame) -> str:
    """Return the footnote on the repeats, with the test samples of every set that there is."""
    source, seeds = table.first_labels()[0], table.most_seeds()
    counts = [
        f"{samples_of_seed(metrics, source, name)} {in_words(name)}"
        for name in TRAINED_ON
        if (metrics["table"] == TABLE + name).any()
    ]
    return (
        f"Mean over {plural(seeds, 'seed')}; {interval_over(seeds)}. Test samples of a seed (of the first dataset): "
        f"{', '.join(counts)}. Bold: best of a dataset."
    )
