"""Registrations whose causes are measured, the file that holds them, and their labels for explainers of causes."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from gpca.causes.truth import BORDERLINE, FAILED, NOMINAL, SUBSETS, Truth
from gpca.io.arrays import REAL, WHOLE, load_arrays, save_arrays
from gpca.io.container import FLAG, Container, Shapes, array
from gpca.io.files import Axes
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS

LABELS = (NOMINAL, *CONCEPTS)
HIDDEN = ("causes", "error_shown")  # arrays attached to registrations that explainers learn from, and see of no other


@dataclass(frozen=True)
class Causes(Container):
    """S registrations, of which T are for testing, with their truth."""

    # The observed cloud is the source and lies where ICP put it, in the model's frame. ICP itself ran the other way.
    # ``concept`` is what adds most to the error, in any state.
    registrations: Registrations
    truth: Truth
    truth_again: Truth  # of the T test samples, measured from other starts: how well anything could do
    applied: np.ndarray = array("S 3", FLAG)
    symmetric: np.ndarray = array("S", FLAG)  # the error is ADD-S
    severity_outliers: np.ndarray = array("S")  # share of the points, 0 where noise was not applied
    candidate: np.ndarray = array("S", WHOLE)  # its number within its split
    # What ICP found from n starts around the initial pose, in meters; the first is that pose. The truth has other runs.
    T_target_source_runs: np.ndarray = array("S n 4 4")
    fitness_runs: np.ndarray = array("S n")
    inlier_rmse_runs: np.ndarray = array("S n")
    error_shown: np.ndarray = array("S")  # min(ADD(-S), d/2) / d of the first of these runs, which is shown

    def rows(self, split: str) -> np.ndarray:
        """Return the row numbers of a split."""
        return self.registrations.rows(split)

    def subset(self, rows: np.ndarray) -> Causes:
        """Return the given rows."""
        test_row = np.cumsum(self.registrations.split == "test") - 1
        tested = rows[self.registrations.split[rows] == "test"]
        return replace(
            super().subset(rows),
            registrations=self.registrations.subset(rows),
            truth=self.truth.subset(rows),
            truth_again=self.truth_again.subset(test_row[tested]),
        )

    def save(self, path: str | Path, axes: Axes | None = None) -> None:
        """Write the npz described in results/README.md."""
        arrays = self.registrations.arrays | self.arrays
        arrays |= {name: getattr(self.truth, name) for name in MEASURED}
        arrays |= {f"{name}_again": getattr(self.truth_again, name) for name in MEASURED}
        arrays |= {name: np.array(getattr(self.truth, name)) for name in LIMITS}
        save_arrays(path, arrays, axes or self.registrations.axes)

    @classmethod
    def load(cls, path: str | Path, expected: Axes | Container | None = None) -> Causes:
        """Read the npz."""
        registrations = Registrations.load(path, expected)
        tested = int((registrations.split == "test").sum())
        shapes: Shapes = dict.fromkeys(MEASURED, (len(registrations), len(SUBSETS))) | dict.fromkeys(LIMITS, ())
        shapes |= {f"{name}_again": (tested, len(SUBSETS)) for name in MEASURED}
        measured = load_arrays(path, shapes, dict.fromkeys(shapes, REAL))
        limits = {name: float(measured[name]) for name in LIMITS}
        truth, truth_again = (
            Truth(measured[f"error{again}"], measured[f"uncertainty{again}"], **limits) for again in ("", "_again")
        )
        arrays = cls.read(path, None, S=len(registrations))
        return cls(**arrays, registrations=registrations, truth=truth, truth_again=truth_again)


MEASURED = ("error", "uncertainty")
LIMITS = tuple(field.name for field in fields(Truth) if field.name not in MEASURED)


def labels_of(truth: Truth) -> np.ndarray:
    """Return (S,) labels: nominal, a failure's dominant cause, or ``borderline``, also of a failure by geometry."""
    named_S = np.where(truth.state == FAILED, truth.dominant, truth.state)
    return np.where(np.isin(named_S, LABELS), named_S, BORDERLINE)


def observed_only(registrations: Registrations) -> Registrations:
    """Registrations without anything that reveals what is wrong with them."""
    hidden = registrations.without_labels()
    return replace(hidden, attached={name: array for name, array in hidden.attached.items() if name not in HIDDEN})


def labeled(causes: Causes) -> Registrations:
    """Return what an explainer learns: labels as the concepts, and what is `HIDDEN` from it later attached."""
    shown = causes.registrations
    hidden = dict(zip(HIDDEN, (causes.truth.causes.astype(float), causes.error_shown), strict=True))
    return replace(shown, concept=labels_of(causes.truth), attached={**shown.attached, **hidden})


def with_label(causes: Causes) -> Registrations:
    """Return those registrations that have a label, as :func:`labeled` returns them."""
    registrations = labeled(causes)
    return registrations.subset(np.flatnonzero(registrations.concept != BORDERLINE))
