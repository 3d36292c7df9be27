"""Registrations whose causes are measured, and the file that holds them."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from gpca.causes.shapley import ALL, SUBSETS
from gpca.causes.truth import LARGEST_ERROR, Truth
from gpca.errors import InputError
from gpca.io.arrays import REAL, load_arrays, save_arrays
from gpca.io.axes import Axes
from gpca.pairs.dataset import CLOUDS, REGISTRATION_COLUMNS, Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.uncertainty.settings import FEWEST_STARTS

MADE_BY = "python -m gpca causes"
ROUNDING = 1e-9


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
        T_target_source_runs: (S, n, 4, 4) what ICP found from n starts around the initial pose, in metres; the first is
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
            InputError: the file is missing, damaged, of another source or seed, holds wrong shapes, NaN or what cannot
                be.
        """
        registrations = Registrations.load(path, axes, MADE_BY)
        n, subsets = len(registrations), len(SUBSETS)
        tested = int((registrations.split == "test").sum())
        shapes: dict[str, tuple[int | str, ...]] = dict.fromkeys(COLUMNS, (n,)) | dict.fromkeys(LIMITS, ())
        shapes |= {"applied": (n, len(CONCEPTS)), "fitness_runs": (n, "n"), "inlier_rmse_runs": (n, "n")}
        shapes |= {"T_target_source_runs": (n, "n", 4, 4)} | dict.fromkeys(MEASURED, (n, subsets))
        shapes |= {f"{name}_again": (tested, subsets) for name in MEASURED}
        kinds = dict.fromkeys(shapes, REAL) | {"applied": "b", "symmetric": "b", "candidate": "iu"}
        arrays = load_arrays(path, shapes, MADE_BY, kinds)
        for name, within in _possible(arrays, registrations).items():
            if not np.all(within):
                raise InputError(path, f"'{name}' contains impossible values", f"regenerate it with '{MADE_BY}'")
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


def _possible(arrays: dict[str, np.ndarray], registrations: Registrations) -> dict[str, np.ndarray | bool]:
    """Return for each array whether its entries can be."""
    possible: dict[str, np.ndarray | bool] = {name: arrays[name] > 0 for name in LIMITS if name != "uncertainty_limit"}
    possible |= {name: arrays[name] >= 0 for name in ("uncertainty_limit", "candidate", "inlier_rmse_runs")}
    possible["failed_limit"] = arrays["failed_limit"] >= arrays["nominal_limit"]
    possible |= {name: (arrays[name] >= 0) & (arrays[name] <= 1) for name in ("severity_outliers", "fitness_runs")}
    tested_S = registrations.split == "test"
    for again, applied in (("", arrays["applied"]), ("_again", arrays["applied"][tested_S])):
        error, uncertainty = arrays[f"error{again}"], arrays[f"uncertainty{again}"]
        possible[f"error{again}"] = (error >= 0) & (error <= LARGEST_ERROR + ROUNDING)
        possible[f"uncertainty{again}"] = (uncertainty >= 0) & (uncertainty[:, :1] <= ROUNDING)
        for name, worth in ((f"error{again}", error), (f"uncertainty{again}", uncertainty)):
            possible[name] = possible[name] & _same_where_not_applied(worth, applied)[:, None]
    # ICP from the initial pose is the first of the runs, and the registration.
    runs_S_n = arrays["T_target_source_runs"]
    first_S = np.abs(runs_S_n[:, :1] - registrations.T_target_source_icp[:, None]).max(axis=(1, 2, 3), initial=0)
    possible["T_target_source_runs"] = (first_S <= ROUNDING) & (runs_S_n.shape[1] >= FEWEST_STARTS)
    trained, tested = (set(registrations.object_name[part].tolist()) for part in (~tested_S, tested_S))
    possible["object_name"] = not trained & tested
    return possible


def _same_where_not_applied(worth_S_8: np.ndarray, applied_S_3: np.ndarray) -> np.ndarray:
    """Return which rows (S,) have the same worth of subsets that differ by a cause that was not applied."""
    bits_S = applied_S_3 @ (1 << np.arange(len(CONCEPTS)))
    effective_S_8 = np.arange(ALL + 1) & bits_S[:, None]
    return (np.take_along_axis(worth_S_8, effective_S_8, axis=1) == worth_S_8).all(axis=1)
