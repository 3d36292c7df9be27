"""Descriptions of registered pairs, in groups, and the file that holds them."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import Causes
from gpca.features.distances import describe_distances
from gpca.features.entropy import ENTROPY, describe_entropy
from gpca.features.motion import STARTS, describe_motion, describe_starts
from gpca.features.pair import ObservedPair, observed_pair
from gpca.features.remedied import describe_remedied
from gpca.features.settings import DENSITIES, GROUPS, MOTION, QUANTILES, REMEDIED, DescriptorSettings
from gpca.io.arrays import TEXT, WHOLE
from gpca.io.container import Container, array
from gpca.process.progress import progress


@dataclass(frozen=True)
class Descriptors(Container):
    """The descriptors of S registrations.

    Attributes:
        sample, split: (S,) as in the registrations.
        distances, planes, motion, starts, remedied, entropy: (S, F) groups; the modules of this folder say what their
            numbers are.
    """

    sample: np.ndarray = array("S", WHOLE)
    split: np.ndarray = array("S", TEXT)
    distances: np.ndarray = array(f"S {4 * QUANTILES}")
    planes: np.ndarray = array(f"S {3 * QUANTILES + len(DENSITIES)}")
    motion: np.ndarray = array(f"S {len(MOTION)}")
    starts: np.ndarray = array(f"S {len(STARTS)}")
    remedied: np.ndarray = array(f"S {len(REMEDIED)}")
    entropy: np.ndarray = array(f"S {len(ENTROPY)}")

    @property
    def groups(self) -> dict[str, np.ndarray]:
        """The descriptors (S, F) by group."""
        return {name: getattr(self, name) for name in GROUPS}


WIDTHS = {name: int(Descriptors.array_fields()[name].shape[1]) for name in GROUPS}


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
    all_described = Descriptors(registrations.sample, registrations.split, **groups, axes=registrations.axes)
    return all_described, np.array(seconds), np.array(icp_seconds)
