"""All metrics of depth frames: of their explanations, and of learning from their labels."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.active_learning.curves import collect_curves
from gpca.experiments.frame_labels.settings import in_percent
from gpca.experiments.real_world import metrics

if TYPE_CHECKING:
    import pandas as pd

TO_TARGET = ("labels_to_target", "epochs_to_target", "reached")  # they differ by the target, all else does not
ONE_TARGET = "epochs_at_target"  # is not counted where there are several


def collect(
    prediction_files: Iterable[str | Path],
    pose_files: Iterable[str | Path],
    one_encoder_files: Iterable[str | Path],
    label_files: Iterable[str | Path],
    targets: Iterable[float],
) -> pd.DataFrame:
    """Return the tidy metrics of the depth frames and, below them, of :func:`collect_labels`."""
    import pandas as pd

    of_explanations = metrics.collect(prediction_files, pose_files, one_encoder_files)
    return pd.concat([of_explanations, *collect_labels(label_files, targets)], ignore_index=True)


def collect_labels(label_files: Iterable[str | Path], targets: Iterable[float]) -> list[pd.DataFrame]:
    """Return the tidy metrics of learning curves on depth frames.

    The column `table` says of which embedding a curve is, ``active_learning/{backbone}`` or ``active_learning/pair``;
    what depends on the target accuracy has the target in percent after it, ``active_learning/{backbone}/70``.

    Args:
        label_files: named ``…/{source}/{strategy}/seed{seed}.csv``.
        targets: accuracies on the test samples.

    Raises:
        InputError: no files, a name of another form, what their readers refuse.
    """
    files = list(label_files)
    by_target = {in_percent(target): collect_curves(files, target) for target in targets}
    whole = next(iter(by_target.values()))
    return [whole[~whole["metric"].isin((*TO_TARGET, ONE_TARGET))]] + [
        curves[curves["metric"].isin(TO_TARGET)].assign(table=lambda rows, end=percent: rows["table"] + f"/{end}")
        for percent, curves in by_target.items()
    ]
