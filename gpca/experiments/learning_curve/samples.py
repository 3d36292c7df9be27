"""The labeled descriptors of registrations, and the file of a chunk of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.errors import InputError
from gpca.experiments.learning_curve.settings import GROUPS
from gpca.features.dataset import WIDTHS
from gpca.features.distances import describe_distances
from gpca.features.motion import describe_motion, describe_starts
from gpca.features.pair import observed_pair
from gpca.io.arrays import REAL, REGENERATE, TEXT, load_arrays, save_arrays
from gpca.io.names import Axes
from gpca.process.progress import progress


@dataclass(frozen=True)
class Lessons:
    """N labeled registrations.

    Attributes:
        groups: name in `GROUPS` -> (N, F).
        label: (N,) nominal or the dominant cause.
    """

    groups: Mapping[str, np.ndarray]
    label: np.ndarray

    def __len__(self) -> int:
        return len(self.label)

    @property
    def features(self) -> np.ndarray:
        """All groups side by side (N, F)."""
        return np.hstack([self.groups[name] for name in GROUPS])

    def subset(self, rows: np.ndarray) -> Lessons:
        """Return the given rows, which may be a mask."""
        return Lessons({name: array[rows] for name, array in self.groups.items()}, self.label[rows])

    def save(self, path: str | Path, axes: Axes) -> None:
        """Write an npz with an array for each group and the labels."""
        save_arrays(path, {**self.groups, "label": self.label}, axes)

    @classmethod
    def load(cls, path: str | Path, axes: Axes) -> Lessons:
        """Read the npz of that source and seed.

        Raises:
            InputError: the file is missing, damaged, of another source or seed, or holds wrong shapes, NaN or labels.
        """
        shapes: dict[str, tuple[int | str, ...]] = {name: ("N", WIDTHS[name]) for name in GROUPS}
        kinds = dict.fromkeys(GROUPS, REAL) | {"label": TEXT}
        arrays = load_arrays(path, shapes | {"label": ("N",)}, kinds, axes)
        if unknown := sorted(set(arrays["label"].tolist()) - set(LABELS)):
            raise InputError(path, f"unknown label '{unknown[0]}'", REGENERATE)
        return cls({name: arrays[name] for name in GROUPS}, arrays["label"])


def joined(parts: Sequence[Lessons]) -> Lessons:
    """Return the samples of several one after the other."""
    groups = {name: np.concatenate([part.groups[name] for part in parts]) for name in GROUPS}
    return Lessons(groups, np.concatenate([part.label for part in parts]))


def describe_cheaply(causes: Causes, icp: ICPSettings) -> Lessons:
    """Return the labels of all rows and those descriptors that need no further registration."""
    source, seed = causes.registrations.axes or ("", 0)
    rows: list[tuple[np.ndarray, ...]] = []
    for row in progress(range(len(causes)), f"descriptors of {source}, seed {seed}"):
        pair = observed_pair(causes, row)  # nothing in these is random
        rows.append((*describe_distances(pair), describe_motion(pair), describe_starts(pair, icp)))
    groups = {name: np.array([row[i] for row in rows]) for i, name in enumerate(GROUPS)}
    return Lessons(groups, labels_of(causes.truth))
