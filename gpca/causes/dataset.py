"""Registrations whose causes are measured, and the file that holds them."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from gpca.causes.shapley import SUBSETS
from gpca.causes.truth import Truth
from gpca.io.arrays import REAL, load_arrays, save_arrays
from gpca.io.names import Axes
from gpca.pairs.dataset import CLOUDS, REGISTRATION_COLUMNS, Registrations
from gpca.pairs.perturbation import CONCEPTS


@dataclass(frozen=True)
class Causes:
    """S registrations, of which T are for testing, with their truth.

    Attributes:
        registrations: as everywhere, the observed cloud is the source and the model the target: the source lies where
            ICP put it, in the model's frame. ICP itself ran the other way. ``concept`` is the one that adds most to the
            error, in any state; only for the failed does it mean much.
        applied: (S, 3) which causes were applied.
        symmetric: (S,) the error is ADD-S.
        severity_outliers: (S,) share of the points, 0 where noise was not applied.
        candidate: (S,) number of the candidate within its split.
        T_target_source_runs: (S, n, 4, 4) what ICP found from n starts around the initial pose, in meters; the first is
            the initial pose itself. They are for explainers, and not the runs that the truth was measured by.
        fitness_runs, inlier_rmse_runs: (S, n) of these.
        truth: of all S.
        truth_again: of the T test samples, measured from other starts: how well anything could do.
    """

    registrations: Registrations
    applied: np.ndarray
    symmetric: np.ndarray
    severity_outliers: np.ndarray
    candidate: np.ndarray
    T_target_source_runs: np.ndarray
    fitness_runs: np.ndarray
    inlier_rmse_runs: np.ndarray
    truth: Truth
    truth_again: Truth

    def __len__(self) -> int:
        return len(self.registrations)

    def rows(self, split: str) -> np.ndarray:
        """Return the row numbers of a split."""
        return self.registrations.rows(split)

    def subset(self, rows: np.ndarray) -> Causes:
        """Return the given rows, in the given order."""
        test_row = np.cumsum(self.registrations.split == "test") - 1
        tested = rows[self.registrations.split[rows] == "test"]
        return replace(
            self,
            registrations=self.registrations.subset(rows),
            truth=self.truth.subset(rows),
            truth_again=self.truth_again.subset(test_row[tested]),
            **{name: getattr(self, name)[rows] for name in COLUMNS},
        )

    def save(self, path: str | Path) -> None:
        """Write the npz described in results/README.md."""
        arrays = {name: getattr(self.registrations, name) for name in (*REGISTRATION_COLUMNS, *CLOUDS)}
        arrays |= {name: getattr(self, name) for name in COLUMNS}
        arrays |= {name: getattr(self.truth, name) for name in MEASURED}
        arrays |= {f"{name}_again": getattr(self.truth_again, name) for name in MEASURED}
        arrays |= {name: np.array(getattr(self.truth, name)) for name in LIMITS}
        save_arrays(path, arrays, self.registrations.axes)

    @classmethod
    def load(cls, path: str | Path, axes: Axes | None = None) -> Causes:
        """Read the npz; `axes` are the source and the seed that it has to be of.

        Raises:
            InputError: the file is missing, damaged, of another source or seed, or holds wrong shapes or NaN.
        """
        registrations = Registrations.load(path, axes)
        n, subsets = len(registrations), len(SUBSETS)
        tested = int((registrations.split == "test").sum())
        shapes: dict[str, tuple[int | str, ...]] = dict.fromkeys(COLUMNS, (n,)) | dict.fromkeys(LIMITS, ())
        shapes |= {"applied": (n, len(CONCEPTS)), "fitness_runs": (n, "n"), "inlier_rmse_runs": (n, "n")}
        shapes |= {"T_target_source_runs": (n, "n", 4, 4)} | dict.fromkeys(MEASURED, (n, subsets))
        shapes |= {f"{name}_again": (tested, subsets) for name in MEASURED}
        kinds = dict.fromkeys(shapes, REAL) | {"applied": "b", "symmetric": "b", "candidate": "iu"}
        arrays = load_arrays(path, shapes, kinds)
        limits = {name: float(arrays[name]) for name in LIMITS}
        truth, truth_again = (
            Truth(arrays[f"error{again}"], arrays[f"uncertainty{again}"], **limits) for again in ("", "_again")
        )
        return cls(
            registrations=registrations,
            truth=truth,
            truth_again=truth_again,
            **{name: arrays[name] for name in COLUMNS},
        )


MEASURED = ("error", "uncertainty")
LIMITS = tuple(field.name for field in fields(Truth) if field.name not in MEASURED)
COLUMNS = tuple(field.name for field in fields(Causes) if field.name not in ("registrations", "truth", "truth_again"))
