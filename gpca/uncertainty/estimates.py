"""Estimates of poses' covariances: which registrations they are of, and the files that hold them."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, get_args

import numpy as np

from gpca.evaluation.measures import source_method_seed
from gpca.io.csv_file import numbers, read_csv
from gpca.io.frame import Frame
from gpca.settings import Bounds, PositiveShare

Kind = Literal["starts", "data", "all"]  # of a reference: what varies in it
KINDS: tuple[Kind, ...] = get_args(Kind)
REFERENCES = tuple(f"reference_{kind}" for kind in KINDS)  # by these names they have rows among the estimators
SIXTH = np.triu_indices(6)
# Upper triangle of Σ, row by row, in squared milliradians and thousandths of the diameter.
COVARIANCE = tuple(f"covariance_{i + 1}{j + 1}" for i, j in zip(*SIXTH, strict=True))
MILLI = 1e3
OF_ROW = ("add_relative", "inlier_rmse", "fitness")  # numbers that a row has without an estimate
KNOWN = ("sample", "object", "cluster", "method", "failed", "failure", *OF_ROW)
COMPARED = ("kl_rotation", "kl_translation", "error_ratio", "mahalanobis", "covered")  # with each reference
OF_REFERENCES = tuple(f"{name}_{kind}" for kind in KINDS for name in COMPARED)
JUDGED = (*OF_REFERENCES, "error_ratio", "mahalanobis", "spread")  # the last three: by the true pose, and of none


@dataclass(frozen=True)
class EstimatorPairSettings:
    """The registrations whose covariance is estimated, and the reference that estimates are compared with."""

    methods: dict[str, Annotated[int, Bounds(minimum=1, maximum=100_000)]]  # test registrations of each source and seed
    train: Annotated[int, Bounds(minimum=8)]  # registrations by each method, for estimators that learn, at most
    train_starts: Annotated[int, Bounds(minimum=7, maximum=1000)]  # runs of each of them, with other data and starts
    points: Annotated[int, Bounds(minimum=64, maximum=65536)]  # of source and of target, at most
    repeats: Annotated[int, Bounds(minimum=20, maximum=100_000)]  # registrations of each reference
    start_rotation_deg: Annotated[float, Bounds(exclusiveMinimum=0, maximum=180)]  # root mean square of starts' offsets
    start_translation: Annotated[float, Bounds(exclusiveMinimum=0, maximum=10)]
    floor: Annotated[float, Bounds(exclusiveMinimum=0, maximum=1)]  # variance added to every covariance that is judged
    failed: PositiveShare  # the config's ``success.error``, in diameters


def covariance_columns(covariance_6_6: np.ndarray | None) -> dict[str, float]:
    """Columns of a covariance in radians and diameters; NaN without one."""
    values = np.full(len(COVARIANCE), np.nan) if covariance_6_6 is None else MILLI**2 * covariance_6_6[SIXTH]
    return dict(zip(COVARIANCE, values.tolist(), strict=True))


def read_estimates(path: str | Path) -> Frame:
    """Read a file of the step ``estimate``: `failed` as booleans, numbers as numbers, NaN where an estimate failed."""
    rows = read_csv(path, (*KNOWN, *JUDGED, *COVARIANCE))
    has_estimate = rows["failure"] == ""
    for name in (*OF_ROW, *JUDGED, *COVARIANCE):
        # Where a reference itself has none, no estimate is compared with it.
        needed = name in OF_ROW or has_estimate & ((rows[name] != "") | (name not in OF_REFERENCES))
        rows[name] = numbers(path, rows, name, needed)
    return rows.assign(failed=rows["failed"] == "True")


def read_estimate_files(files: Iterable[str | Path]) -> dict[tuple[str, str, int], Frame]:
    return {source_method_seed(path): read_estimates(path) for path in files}
