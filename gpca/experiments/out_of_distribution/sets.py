"""Samples like and unlike those of the training, embedded, and their distances to the training samples.

Two encoders, each with training samples of its own: the source's encoder, and one that never saw some of the objects.
Learners fitted to the training samples of an encoder explain the test samples of its sets.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from gpca.io.arrays import REAL, TEXT, WHOLE, load_arrays, save_arrays
from gpca.io.names import Axes
from gpca.pairs.dataset import REGISTRATION_COLUMNS, Registrations, ragged

# set -> the set that holds the training samples of its encoder and learners
TRAINED_ON = {
    "in_distribution": "in_distribution",
    "severity": "in_distribution",
    "source": "in_distribution",
    "seen_objects": "seen_objects",
    "objects": "seen_objects",
}
SPACES, KINDS = ("analytical", "embedding"), ("knn", "mahalanobis")
DISTANCES = tuple(f"{kind}_{space}" for space in SPACES for kind in KINDS)


@dataclass(frozen=True)
class ShiftedSets:
    """S samples of all sets.

    Attributes:
        set: (S,) name of the set, a key of `TRAINED_ON`.
        split: (S,) ``train`` (fitted to) or ``test``.
        sample, concept, object_name, cluster: (S,) as in :class:`gpca.pairs.dataset.Registrations`.
        h: (S, d) embeddings by the encoder of the set.
        distance: (S, 4) `DISTANCES` to the training samples of the set's encoder; 0 for these themselves.
    """

    set: np.ndarray
    split: np.ndarray
    sample: np.ndarray
    concept: np.ndarray
    object_name: np.ndarray
    cluster: np.ndarray
    h: np.ndarray
    distance: np.ndarray

    def rows(self, name: str, split: str) -> np.ndarray:
        """Return the row numbers of a set and split."""
        return np.flatnonzero((self.set == name) & (self.split == split))

    def registrations(self, rows: np.ndarray) -> Registrations:
        """Return the rows as explainers that read embeddings take them: without clouds and poses."""
        nan_S = np.full(len(rows), np.nan)
        zeros_S = np.zeros(len(rows), int)
        columns: dict[str, Any] = dict.fromkeys(REGISTRATION_COLUMNS, nan_S) | {"object_index": zeros_S}
        columns |= {name: np.full((len(rows), 4, 4), np.nan) for name in REGISTRATION_COLUMNS if name.startswith("T_")}
        columns |= {
            name: getattr(self, name)[rows] for name in ("sample", "split", "concept", "object_name", "cluster")
        }
        nothing = [np.zeros((0, 3), np.float32)] * len(rows)
        return Registrations(**columns | ragged(nothing, nothing), attached={"embedding": self.h[rows]})

    def save(self, path: str | Path, axes: Axes) -> None:
        """Write the npz described in results/README.md; `axes` are the source and the seed."""
        save_arrays(path, {field.name: getattr(self, field.name) for field in fields(self)}, axes)

    @classmethod
    def load(cls, path: str | Path, axes: Axes | None = None) -> ShiftedSets:
        """Read the npz; `axes` are the source and the seed that it has to be of.

        Raises:
            InputError: missing or damaged file, one of another source or seed, wrong shapes, or NaN.
        """
        shapes: dict[str, tuple[int | str, ...]] = {field.name: ("S",) for field in fields(cls)}
        shapes |= {"h": ("S", "d"), "distance": ("S", len(DISTANCES))}
        kinds = dict.fromkeys(shapes, TEXT) | {"sample": WHOLE, "h": REAL, "distance": REAL}
        arrays = load_arrays(path, shapes, kinds, axes)
        return cls(**{name: arrays[name] for name in shapes})

    @classmethod
    def join(cls, parts: list[ShiftedSets]) -> ShiftedSets:
        """Return the samples of all parts, in their order."""
        names = [field.name for field in fields(cls)]
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})
