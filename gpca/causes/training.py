"""What explainers of causes learn from: labeled samples of all sources, but those of families that are tested."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from gpca.causes.dataset import LABELS
from gpca.causes.descriptors import WIDTHS
from gpca.io.arrays import TEXT
from gpca.io.container import Container, array
from gpca.pairs.dataset import Registrations

QUICK = ("distances", "planes", "motion", "starts")  # groups of descriptors that need no further registration


@dataclass(frozen=True)
class LabeledSamples(Container):
    """N labeled registrations, nominal or with the dominant cause: the `QUICK` groups of descriptors (N, F)."""

    distances: np.ndarray = array(f"N {WIDTHS['distances']}")
    planes: np.ndarray = array(f"N {WIDTHS['planes']}")
    motion: np.ndarray = array(f"N {WIDTHS['motion']}")
    starts: np.ndarray = array(f"N {WIDTHS['starts']}")
    concept: np.ndarray = array("N", TEXT, choices=LABELS)
    cluster: np.ndarray = array("N", TEXT)  # the family

    @classmethod
    def of(cls, registrations: Registrations) -> LabeledSamples:
        """Return the labels and quick descriptors of registrations that have both."""
        groups = {name: registrations.attached[name] for name in QUICK}
        return cls(**groups, concept=registrations.concept, cluster=registrations.cluster, axes=None)

    @property
    def attached(self) -> Mapping[str, np.ndarray]:
        """The groups by name, as explainers read them."""
        return {name: getattr(self, name) for name in QUICK}

    @property
    def features(self) -> np.ndarray:
        """All groups side by side (N, F)."""
        return np.hstack([*self.attached.values()])


Samples = TypeVar("Samples", Registrations, LabeledSamples)


def joined_without(families: Sequence[str] | np.ndarray, parts: Iterable[Samples]) -> Samples:
    """Return the samples of several, but those of families that are tested."""
    tested = np.asarray(families, str)
    left = [part.subset(np.flatnonzero(~np.isin(part.cluster, tested))) for part in parts]
    return left[0] if len(left) == 1 else type(left[0]).joined(left)
