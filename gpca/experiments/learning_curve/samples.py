"""The labeled descriptors of registrations, and the file of a chunk of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.descriptors import WIDTHS, describe_motion, describe_starts, observed_pair
from gpca.experiments.learning_curve.settings import GROUPS
from gpca.io.arrays import TEXT
from gpca.io.container import Container, array
from gpca.pairs.distances import describe_distances
from gpca.process.progress import progress


@dataclass(frozen=True)
class Lessons(Container):
    """N labeled registrations.

    Attributes:
        distances, planes, motion, starts: (N, F) groups of descriptors.
        label: (N,) nominal or the dominant cause.
    """

    distances: np.ndarray = array(f"N {WIDTHS['distances']}")
    planes: np.ndarray = array(f"N {WIDTHS['planes']}")
    motion: np.ndarray = array(f"N {WIDTHS['motion']}")
    starts: np.ndarray = array(f"N {WIDTHS['starts']}")
    label: np.ndarray = array("N", TEXT, choices=LABELS)

    @property
    def features(self) -> np.ndarray:
        """All groups side by side (N, F)."""
        return np.hstack([getattr(self, name) for name in GROUPS])


def describe_cheaply(causes: Causes, icp: ICPSettings) -> Lessons:
    """Return the labels of all rows and those descriptors that need no further registration."""
    source, seed = causes.registrations.axes or ("", 0)
    rows: list[tuple[np.ndarray, ...]] = []
    for row in progress(range(len(causes)), f"descriptors of {source}, seed {seed}"):
        pair = observed_pair(causes, row)  # nothing in these is random
        rows.append((*describe_distances(pair), describe_motion(pair), describe_starts(pair, icp)))
    groups: dict[str, Any] = {name: np.array([row[i] for row in rows]) for i, name in enumerate(GROUPS)}
    return Lessons(**groups, label=labels_of(causes.truth))
