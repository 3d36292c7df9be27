"""Intervals over clusters of samples and seeds of the shares beside printed numbers, from single predictions.

Seeds share objects, so that an interval over seeds does not say how much the choice of the objects matters; and objects
of one family, or seen in one scene, are alike (:mod:`gpca.objects.splits`). Values of
which a run keeps no predictions (kernels, learning curves, times, areas and correlations) have the former only.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gpca.attribution.confidence import LEVEL, bounds, pigeonhole_weights
from gpca.attribution.metrics import ALL, PREDICTED_AS, source_method_seed
from gpca.attribution.predictions import read_predictions
from gpca.comparison.published import Counterpart
from gpca.seeds import generator

FOLDERS = {"metrics.csv": "predictions", "real_world.csv": "predictions", "diagnostics.csv": "learners"}
Folder = tuple[str, str, str]  # e.g. ("predictions", "ycb", "gpca_paper")


def folder_behind(counterpart: Counterpart | None) -> Folder | None:
    """Return the folder of the predictions that a counterpart is a share of; None if it is no share of samples."""
    if counterpart is None or counterpart.statistic != "mean" or counterpart.file not in FOLDERS:
        return None
    taken = len(counterpart.metrics) == 2 and counterpart.metrics[0].startswith(PREDICTED_AS)
    if not (counterpart.metrics == ("accuracy",) or taken):
        return None
    return FOLDERS[counterpart.file], counterpart.sources[0], counterpart.methods[0]


def folders_behind(counterparts: Iterable[Counterpart | None]) -> list[Folder]:
    """Return the folders of all of them, each once."""
    return sorted({folder for counterpart in counterparts if (folder := folder_behind(counterpart))})


@dataclass(frozen=True)
class Drawn:
    """The share that a counterpart is, in every draw of clusters and seeds; the draws of one source are the same.

    Attributes:
        share_B: in [0, 1], NaN in a draw without any sample.
        weights_B_N: how often each draw has each sample of the folder.
        of_N: which of these the share is of.
    """

    share_B: np.ndarray
    weights_B_N: np.ndarray
    of_N: np.ndarray

    def bounds(self, level: float = LEVEL) -> tuple[float, float]:
        """Return the bounds of the share."""
        return bounds(self.share_B, self.weights_B_N[:, self.of_N], level=level)

    def bounds_of_difference(self, other: Drawn, level: float = LEVEL) -> tuple[float, float]:
        """Return the bounds of the share minus another, draw by draw."""
        drawn_B_n = self.weights_B_N[:, self.of_N]
        return bounds(self.share_B - other.share_B, drawn_B_n, difference=True, level=level)


def cluster_draws(
    counterparts: Iterable[Counterpart | None], prediction_files: Iterable[str | Path]
) -> dict[Counterpart, Drawn]:
    """Return the draws of the shares by the pigeonhole bootstrap over clusters and seeds.

    Args:
        counterparts: those that are no shares of samples, or whose folder has no file, are left out.
        prediction_files: named ``…/{predictions or learners}/{source}/{method}/seed{seed}.csv``.

    Raises:
        InputError: a name of another form, a file that :func:`gpca.attribution.predictions.read_predictions` refuses.
    """
    in_folder: dict[Folder, set[Counterpart]] = defaultdict(set)
    for counterpart in counterparts:
        if counterpart and (folder := folder_behind(counterpart)):
            in_folder[folder].add(counterpart)
    files: dict[Folder, list[str | Path]] = defaultdict(list)
    for path in prediction_files:
        source, method, _ = source_method_seed(path)
        files[Path(path).parts[-4], source, method].append(path)
    drawn: dict[Counterpart, Drawn] = {}
    for folder, of_folder in in_folder.items():
        if folder in files:
            rows = _samples(files[folder])
            weights_B_N = pigeonhole_weights(generator("printed", folder[1]), rows["seed"], rows["cluster"])
            drawn |= {counterpart: _drawn(counterpart, rows, weights_B_N) for counterpart in of_folder}
    return drawn


def _samples(paths: list[str | Path]):
    """Return the test samples of all seeds."""
    import pandas as pd

    parts = []
    for path in paths:
        labels = ("set",) if Path(path).parts[-4] == "learners" else ()
        rows = read_predictions(path, labels)
        parts.append(rows[rows["split"] == "test"].assign(seed=source_method_seed(path)[2]))
    return pd.concat(parts, ignore_index=True)


def _drawn(counterpart: Counterpart, rows, weights_B_N: np.ndarray) -> Drawn:
    of_concept = (rows["concept_true"] == counterpart.concept) | (counterpart.concept == ALL)
    if "set" in rows:
        of_concept &= rows["set"] == counterpart.table.partition("/")[2]
    named = rows["concept_true"]
    if counterpart.metrics[0].startswith(PREDICTED_AS):
        named = counterpart.metrics[0].removeprefix(PREDICTED_AS)
    hits_N = ((rows["concept_predicted"] == named) & ~rows["abstained"]).to_numpy(float)
    of_N = of_concept.to_numpy()
    weights_B_n = weights_B_N[:, of_N]
    with np.errstate(invalid="ignore"):  # a draw without any sample of the concept has no share
        return Drawn(weights_B_n @ hits_N[of_N] / weights_B_n.sum(axis=1), weights_B_N, of_N)
