"""Intervals over clusters of samples and seeds of the shares beside printed numbers, from single predictions.

Seeds share objects, so that an interval over seeds does not say how much the choice of the objects matters; and objects
of one family, or seen in one scene, are alike (:mod:`gpca.objects.splits`). Values of
which a run keeps no predictions (kernels, learning curves, times, areas and correlations) have the former only.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from gpca.attribution.confidence import bounds, pigeonhole_weights
from gpca.attribution.metrics import ALL, PREDICTED_AS, source_method_seed
from gpca.attribution.predictions import read_predictions
from gpca.comparison.published import Counterpart, Number
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


def folders_behind(numbers: Iterable[Number]) -> list[Folder]:
    """Return the folders of all of them, each once."""
    return sorted({folder for number in numbers if (folder := folder_behind(number.counterpart))})


def cluster_intervals(
    numbers: Iterable[Number], prediction_files: Iterable[str | Path]
) -> dict[Counterpart, tuple[float, float]]:
    """Return counterpart -> bounds of its share by the pigeonhole bootstrap over clusters and seeds.

    Args:
        numbers: the printed numbers; those whose folder has no file are left out.
        prediction_files: named ``…/{predictions or learners}/{source}/{method}/seed{seed}.csv``.

    Raises:
        InputError: a name of another form, a file that :func:`gpca.attribution.predictions.read_predictions` refuses.
    """
    counterparts: dict[Folder, set[Counterpart]] = defaultdict(set)
    for number in numbers:
        if number.counterpart and (folder := folder_behind(number.counterpart)):
            counterparts[folder].add(number.counterpart)
    files: dict[Folder, list[str | Path]] = defaultdict(list)
    for path in prediction_files:
        source, method, _ = source_method_seed(path)
        files[Path(path).parts[-4], source, method].append(path)
    intervals: dict[Counterpart, tuple[float, float]] = {}
    for folder, of_folder in counterparts.items():
        if folder in files:
            rows = _samples(files[folder])
            weights_B_N = pigeonhole_weights(generator("printed", *folder), rows["seed"], rows["cluster"])
            intervals |= {counterpart: _bounds_of(counterpart, rows, weights_B_N) for counterpart in of_folder}
    return intervals


def _samples(paths: list[str | Path]):
    """Return the test samples of all seeds."""
    import pandas as pd

    parts = []
    for path in paths:
        labels = ("set",) if Path(path).parts[-4] == "learners" else ()
        rows = read_predictions(path, labels)
        parts.append(rows[rows["split"] == "test"].assign(seed=source_method_seed(path)[2]))
    return pd.concat(parts, ignore_index=True)


def _bounds_of(counterpart: Counterpart, rows, weights_B_N: np.ndarray) -> tuple[float, float]:
    of_concept = (rows["concept_true"] == counterpart.concept) | (counterpart.concept == ALL)
    if "set" in rows:
        of_concept &= rows["set"] == counterpart.table.partition("/")[2]
    named = rows["concept_true"]
    if counterpart.metrics[0].startswith(PREDICTED_AS):
        named = counterpart.metrics[0].removeprefix(PREDICTED_AS)
    hits_N = ((rows["concept_predicted"] == named) & ~rows["abstained"]).to_numpy(float)
    weights_B_n = weights_B_N[:, of_concept.to_numpy()]
    with np.errstate(invalid="ignore"):  # a draw without any sample of the concept has no share
        share_B = weights_B_n @ hits_N[of_concept.to_numpy()] / weights_B_n.sum(axis=1)
    return bounds(share_B, weights_B_n)
