"""The files of the estimates: a row per registration, and the reference's results, which a figure shows."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.evaluation.measures import source_method_seed
from gpca.experiments.estimators.settings import KINDS
from gpca.io.arrays import TEXT, WHOLE
from gpca.io.container import Container, array
from gpca.io.csv_file import numbers, read_csv

if TYPE_CHECKING:
    import pandas as pd

SIXTH = np.triu_indices(6)
# Upper triangle of Σ, row by row, in squared milliradians and thousandths of the diameter.
COVARIANCE = tuple(f"covariance_{i + 1}{j + 1}" for i, j in zip(*SIXTH, strict=True))
MILLI = 1e3
KNOWN = ("sample", "object", "cluster", "method", "add_relative", "failed", "inlier_rmse", "fitness", "failure")
OF_ROW = ("add_relative", "inlier_rmse", "fitness")  # numbers that a row has without an estimate
COMPARED = ("kl_rotation", "kl_translation", "error_ratio", "mahalanobis", "covered")  # with each reference
OF_REFERENCES = tuple(f"{name}_{kind}" for kind in KINDS for name in COMPARED)
JUDGED = (*OF_REFERENCES, "error_ratio", "mahalanobis", "spread")  # the last three: by the true pose, and of none


def reference_name(kind: str) -> str:
    """Return the name by which a reference stands among the estimators."""
    return f"reference_{kind}"


def covariance_columns(covariance_6_6: np.ndarray | None) -> dict[str, float]:
    """Return the columns of a covariance in radians and diameters; NaN without one."""
    values = np.full(len(COVARIANCE), np.nan) if covariance_6_6 is None else MILLI**2 * covariance_6_6[SIXTH]
    return dict(zip(COVARIANCE, values.tolist(), strict=True))


def covariance_of(row: pd.Series) -> np.ndarray:
    """Return Σ (6, 6) of a row, in radians and diameters."""
    upper_6_6 = np.zeros((6, 6))
    upper_6_6[SIXTH] = row[list(COVARIANCE)].to_numpy(dtype=float) / MILLI**2
    return upper_6_6 + np.triu(upper_6_6, 1).T


def read_estimates(path: str | Path) -> pd.DataFrame:
    """Read a file of the step ``estimate``: `failed` as booleans, numbers as numbers, NaN where an estimate failed."""
    rows = read_csv(path, (*KNOWN, *JUDGED, *COVARIANCE))
    has_estimate = rows["failure"] == ""
    for name in (*OF_ROW, *JUDGED, *COVARIANCE):
        # Where a reference itself has none, no estimate is compared with it.
        needed = name in OF_ROW or has_estimate & ((rows[name] != "") | (name not in OF_REFERENCES))
        rows[name] = numbers(path, rows, name, needed)
    return rows.assign(failed=rows["failed"] == "True")


def read_estimate_files(files: Iterable[str | Path]) -> dict[tuple[str, str, int], pd.DataFrame]:
    """Return the rows of files named `…/{source}/{estimator}/seed{seed}.csv` by these three."""
    return {source_method_seed(path): read_estimates(path) for path in files}


@dataclass(frozen=True)
class ReferenceSamples(Container):
    """The results of references for registrations, S in all, as twists about the pose, in radians and diameters.

    Attributes:
        sample, method, kind: (S,) which registration, and which reference.
        twists: (ΣN, 6) float32, those of registration i are ``twists[offsets[i]:offsets[i + 1]]``.
        true_twist: (S, 6) of the true pose.
    """

    sample: np.ndarray = array("S", WHOLE)
    method: np.ndarray = array("S", TEXT)
    kind: np.ndarray = array("S", TEXT)
    twists: np.ndarray = array("N 6", offsets="offsets", fewest=0)
    offsets: np.ndarray = array("S+1", WHOLE)
    true_twist: np.ndarray = array("S 6")

    def twists_of(self, i: int) -> np.ndarray:
        """Return the twists (N, 6) of a row."""
        return self.part("twists", i).astype(np.float64)
