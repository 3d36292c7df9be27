"""Samples like and unlike those of the training, embedded, and their distances to the training samples."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gpca.io.arrays import TEXT, WHOLE
from gpca.io.container import Container, array
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


def with_training_like(shifted: str) -> str:
    """Name of a shifted set together with the test samples like the training's of the same encoder."""
    return f"{TRAINED_ON[shifted]}+{shifted}"


@dataclass(frozen=True)
class ShiftedSets(Container):
    """S samples of all sets."""

    set: np.ndarray = array("S", TEXT)  # name of the set, a key of `TRAINED_ON`
    split: np.ndarray = array("S", TEXT)  # ``train`` (fitted to) or ``test``
    sample: np.ndarray = array("S", WHOLE)
    concept: np.ndarray = array("S", TEXT)
    object_name: np.ndarray = array("S", TEXT)
    cluster: np.ndarray = array("S", TEXT)
    h: np.ndarray = array("S d")  # embeddings by the encoder of the set
    # `DISTANCES` to the training samples of the set's encoder; 0 for these themselves.
    distance: np.ndarray = array(f"S {len(DISTANCES)}")

    def rows(self, name: str, split: str) -> np.ndarray:
        """Row numbers of a set and split."""
        return np.flatnonzero((self.set == name) & (self.split == split))

    def registrations(self, rows: np.ndarray) -> Registrations:
        """Rows for explainers that read embeddings: without clouds and poses."""
        nan_S = np.full(len(rows), np.nan)
        columns: dict[str, Any] = dict.fromkeys(REGISTRATION_COLUMNS, nan_S)
        columns |= {name: np.full((len(rows), 4, 4), np.nan) for name in REGISTRATION_COLUMNS if name.startswith("T_")}
        columns |= {name: self.arrays[name][rows] for name in ("sample", "split", "concept", "object_name", "cluster")}
        columns["object_index"] = np.zeros(len(rows), int)
        nothing = [np.zeros((0, 3), np.float32)] * len(rows)
        return Registrations(**columns | ragged(nothing, nothing), attached={"embedding": self.h[rows]})
