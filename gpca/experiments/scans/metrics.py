"""Recalls of registration methods on scans, by overlap and by start, with intervals over scenes.

A registration is correct by the RMSE over the true overlap (:mod:`gpca.scans.pair`), whatever the method says of it,
as in 3DMatch's benchmark; a method that ends without any correspondence has no pose, so it is not correct.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.evaluation.intervals import Clustered, Estimate
from gpca.evaluation.measures import ALL, intervals, source_method_seed
from gpca.experiments.registration_methods import row_name
from gpca.io.csv_file import numbers, read_csv
from gpca.scans.pair import ScanSuccess
from gpca.scans.scene import stratum_of

if TYPE_CHECKING:
    import pandas as pd

TABLE = "scans"
RECALL, FAILED, CLOSE = "recall", "failed", "recall_15deg_30cm"
CLOSE_DEG, CLOSE_M = 15.0, 0.3  # of rotation and translation: the other criterion of 3DMatch, as Zhang et al. 2023
LISTS = {"3DMatch": (0.3, 1.0), "3DLoMatch": (0.1, 0.3)}  # the benchmark's lists of pairs, by overlap
NUMBERS = ("size_m", "overlap", "rmse_m", "rotation_error_rad", "translation_error_m", "fitness")
TEXTS = ("sample", "pair", "cluster", "kind", "rung", "start", "failure", "inlier_rmse")


def read_trials(path: str | Path) -> pd.DataFrame:
    """Read a file of the step ``register_scans``: numbers as numbers, the rest as text.

    Raises:
        InputError: missing or unreadable file, a column that is missing or unknown, a value that is no number.
    """
    rows = read_csv(path, (*NUMBERS, *TEXTS))
    for name in NUMBERS:
        rows[name] = numbers(path, rows, name)
    return rows


def collect_scans(files: Iterable[str | Path], strata: Sequence[float], success: Mapping[str, Any]) -> pd.DataFrame:
    """Return recalls and failures of every data set, method and start, with 95 % intervals over its scenes.

    The rows are those of :mod:`gpca.evaluation.measures`; ``concept`` is ``all``, a stratum, a rung of the ladder, or
    one of the benchmark's lists.

    Args:
        files: named `…/{data set}/{method}/seed{seed}.csv`.
        strata: edges of the strata of overlap.
        success: the config's section ``scans.success``.

    Raises:
        InputError: no files, a name of another form, or what :func:`read_trials` raises.
    """
    import pandas as pd

    limits, frames = ScanSuccess(**success), []
    for path in files:
        name, method, seed = source_method_seed(path)
        rows = read_trials(path)
        row_N = [row_name(method, start) for start in rows["start"]]
        frames.append(rows.assign(seed=seed, row=row_N, dataset=name))
    records = []
    if frames:
        for (name, row), trials in pd.concat(frames, ignore_index=True).groupby(["dataset", "row"], sort=False):
            samples = Clustered.drawn(trials["seed"], trials["cluster"], "scan intervals", name)
            for concept, chosen_N in _groups(trials, strata).items():
                if chosen_N.any():
                    own = samples.subset(chosen_N)
                    for metric, estimate in _estimates(trials[chosen_N], own, limits).items():
                        records.append(own.record((TABLE, str(name), str(row), metric, concept), estimate))
    return intervals(records, "scans")


def _groups(trials: pd.DataFrame, strata: Sequence[float]) -> dict[str, np.ndarray]:
    """Return which trials (N,) are of each stratum, list and rung."""
    overlap_N = trials["overlap"].to_numpy()
    stratum_N = np.array([stratum_of(share, strata) or "" for share in overlap_N])
    groups = {ALL: np.ones(len(trials), bool)}
    groups |= {name: stratum_N == name for name in sorted(set(stratum_N) - {""})}
    for name, (low, high) in LISTS.items():
        groups[name] = (overlap_N >= low) & ((overlap_N < high) | ((high == 1) & (overlap_N == 1)))
    return groups | {name: (trials["rung"] == name).to_numpy() for name in trials["rung"].unique()}


def _estimates(trials: pd.DataFrame, samples: Clustered, limits: ScanSuccess) -> dict[str, Estimate]:
    has_pose_N = trials["fitness"].to_numpy() > 0
    limit_N = np.where(trials["kind"] == "room", limits.room_m, limits.object_share * trials["size_m"])
    turned_N, moved_N = np.rad2deg(trials["rotation_error_rad"]), trials["translation_error_m"]
    return {
        RECALL: samples.share(has_pose_N & (trials["rmse_m"].to_numpy() < limit_N)),
        FAILED: samples.share((trials["failure"] != "").to_numpy()),
        CLOSE: samples.share(has_pose_N & ((turned_N < CLOSE_DEG) & (moved_N < CLOSE_M)).to_numpy()),
    }
