"""Descriptions of registered pairs, in groups, and the file that holds them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import Causes
from gpca.errors import InputError
from gpca.features.distances import describe_distances
from gpca.features.entropy import ENTROPY, describe_entropy
from gpca.features.motion import STARTS, describe_motion, describe_starts
from gpca.features.pair import ObservedPair, observed_pair
from gpca.features.remedied import describe_remedied
from gpca.features.settings import DENSITIES, GROUPS, MOTION, QUANTILES, REMEDIED, DescriptorSettings
from gpca.io.arrays import REAL, REGENERATE, TEXT, WHOLE, load_arrays, save_arrays
from gpca.io.names import Axes
from gpca.pairs.dataset import Registrations
from gpca.process.progress import progress

WIDTHS = {  # of the groups
    "distances": 4 * QUANTILES,
    "planes": 3 * QUANTILES + len(DENSITIES),
    "motion": len(MOTION),
    "starts": len(STARTS),
    "remedied": len(REMEDIED),
    "entropy": len(ENTROPY),
}


@dataclass(frozen=True)
class Descriptors:
    """The descriptors of S registrations.

    Attributes:
        sample, split: (S,) as in the registrations.
        groups: name in `GROUPS` -> (S, F); the modules of this folder say what their numbers are.
        axes: the source and the seed of the registrations.
    """

    sample: np.ndarray
    split: np.ndarray
    groups: Mapping[str, np.ndarray]
    axes: Axes | None

    def save(self, path: str | Path) -> None:
        """Write an npz with an array for each group."""
        save_arrays(path, {"sample": self.sample, "split": self.split, **self.groups}, self.axes)

    @classmethod
    def load(cls, path: str | Path, registrations: Registrations) -> Descriptors:
        """Read the npz of these registrations.

        Raises:
            InputError: the file is missing, damaged, of other samples, of another source or seed, or holds wrong
                shapes or NaN.
        """
        shapes: dict[str, tuple[int | str, ...]] = {name: ("S", WIDTHS[name]) for name in GROUPS}
        kinds = dict.fromkeys(GROUPS, REAL) | {"sample": WHOLE, "split": TEXT}
        arrays = load_arrays(path, shapes | {"sample": ("S",), "split": ("S",)}, kinds, registrations.axes)
        if not all(np.array_equal(arrays[name], getattr(registrations, name)) for name in ("sample", "split")):
            raise InputError(path, "its samples differ from those of the registrations", REGENERATE)
        return cls(arrays["sample"], arrays["split"], {name: arrays[name] for name in GROUPS}, registrations.axes)


def describe_plainly(pair: ObservedPair, icp: ICPSettings) -> dict[str, np.ndarray]:
    """Return the groups of a pair that are quick to measure: distances, planes, motion and starts."""
    distances, planes = describe_distances(pair)
    return {
        "distances": distances,
        "planes": planes,
        "motion": describe_motion(pair),
        "starts": describe_starts(pair, icp),
    }


def describe(pair: ObservedPair, settings: DescriptorSettings, icp: ICPSettings) -> tuple[dict[str, np.ndarray], float]:
    """Return every group of a pair, and the seconds that its registrations with remedies took."""
    described = describe_plainly(pair, icp) | {"entropy": describe_entropy(pair)}
    started = perf_counter()
    described["remedied"] = describe_remedied(pair, settings, icp)
    return described, perf_counter() - started


def describe_all(
    causes: Causes, source: str, seed: int, settings: DescriptorSettings, icp: ICPSettings
) -> tuple[Descriptors, np.ndarray, np.ndarray]:
    """Return the descriptors of every row, the seconds (S,) that each took, and those of its registrations."""
    rows, seconds, icp_seconds = [], [], []
    for row in progress(range(len(causes)), f"descriptors of {source}, seed {seed}"):
        started = perf_counter()
        described, remedies = describe(observed_pair(causes, row, source, seed, "descriptors"), settings, icp)
        rows.append(described)
        seconds.append(perf_counter() - started)
        icp_seconds.append(remedies)
    registrations = causes.registrations
    groups = {name: np.array([described[name] for described in rows]) for name in GROUPS}
    all_described = Descriptors(registrations.sample, registrations.split, groups, registrations.axes)
    return all_described, np.array(seconds), np.array(icp_seconds)
