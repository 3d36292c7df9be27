"""Scenes scanned from several places, the choice of their pairs, and the file that holds the pairs of a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from gpca.alignment.rigid import inverse, transform
from gpca.errors import InputError
from gpca.scans.pair import ROOM_M, VOXEL_M, Kind, ScanPair, overlap_of_voxels, voxels
from gpca.seeds import generator

FEWEST_SCANS = 2


@dataclass(frozen=True)
class Scan:
    """Points (N, 3) in the frame of their sensor, in meters.

    Attributes:
        T_scene_scan: the pose in the scene; None where poses are known by pairs alone.
        viewpoint_3: where the sensor stood, in the same frame as the points; None where that is not known.
    """

    points_N_3: np.ndarray
    T_scene_scan: np.ndarray | None = None
    viewpoint_3: np.ndarray | None = None


@dataclass(frozen=True)
class Known:
    """What a data set prints of a pair; None where it prints nothing.

    Attributes:
        target, source: names of scans.
        overlap: share in [0, 1].
        T_target_source: the true pose.
    """

    target: str
    source: str
    overlap: float | None = None
    T_target_source: np.ndarray | None = None


@dataclass(frozen=True)
class Scene:
    """A scene.

    Attributes:
        name, family: as of :class:`gpca.scans.pair.ScanPair`.
        kind: a room or an object.
        scans: by name, in order.
        printed: the pairs that the data set lists; where it lists none, each two scans are a pair.
    """

    name: str
    kind: Kind
    scans: Mapping[str, Scan]
    printed: tuple[Known, ...] = ()
    family: str = field(default="")

    def __post_init__(self) -> None:
        if len(self.scans) < FEWEST_SCANS:
            raise InputError(f"scene {self.name}", f"has {len(self.scans)} scans", "give at least two")
        for pair in self.printed:
            for name in (pair.target, pair.source):
                if name not in self.scans:
                    raise InputError(f"scene {self.name}", f"lists a pair with scan '{name}'", "add that scan")

    @cached_property
    def size_m(self) -> float:
        """The diagonal of the box around all scans; of a room :data:`gpca.scans.pair.ROOM_M`, as nothing reads it."""
        if self.kind == "room":
            return ROOM_M
        corners = [
            corner
            for name, scan in self.scans.items()
            for moved in [transform(self._pose(name), scan.points_N_3)]
            for corner in (moved.min(axis=0), moved.max(axis=0))
        ]
        return float(np.linalg.norm(np.ptp(np.stack(corners), axis=0)))

    def known(self) -> Iterator[Known]:
        """Yield every pair with its pose and overlap, which is measured where the data set does not print it."""
        names, scale, thin = list(self.scans), self.size_m / ROOM_M, dict[str, np.ndarray]()
        every = (Known(names[i], names[j]) for i in range(len(names)) for j in range(i + 1, len(names)))
        for pair in self.printed or every:
            T_target_source = self._relative(pair)
            if (share := pair.overlap) is None:
                for name in {pair.source, pair.target} - thin.keys():
                    thin[name] = voxels(self.scans[name].points_N_3, VOXEL_M * scale)
                share = overlap_of_voxels(thin[pair.source], thin[pair.target], T_target_source, scale)
            yield Known(pair.target, pair.source, share, T_target_source)

    def pair(self, known: Known) -> ScanPair:
        """Return a pair with its clouds."""
        source, target = self.scans[known.source], self.scans[known.target]
        return ScanPair(
            source.points_N_3,
            target.points_N_3,
            self._relative(known),
            float("nan") if known.overlap is None else known.overlap,
            self.name,
            self.kind,
            self.size_m,
            known.source,
            known.target,
            source.viewpoint_3,
            target.viewpoint_3,
            self.family,
        )

    def _relative(self, pair: Known) -> np.ndarray:
        if pair.T_target_source is not None:
            return pair.T_target_source
        return inverse(self._pose(pair.target)) @ self._pose(pair.source)

    def _pose(self, name: str) -> np.ndarray:
        if (T_scene_scan := self.scans[name].T_scene_scan) is None:
            raise InputError(f"scene {self.name}", f"has no pose of scan '{name}'", "give a pose of every scan")
        return T_scene_scan


def stratum_name(low: float, high: float) -> str:
    """Return e.g. ``overlap_0.3_0.5``."""
    return f"overlap_{low:g}_{high:g}"


def stratum_of(overlap: float, edges: Sequence[float]) -> str | None:
    """Return the stratum that an overlap is in, the upper edge of the last one included; None where it is in none."""
    for low, high in pairwise(edges):
        if low <= overlap < high or (overlap == high == edges[-1]):
            return stratum_name(low, high)
    return None


def choose_pairs(scenes: Iterable[Scene], edges: Sequence[float], most: int, *axes: object) -> list[ScanPair]:
    """Return up to `most` pairs of each scene and stratum, stratum by stratum, scene by scene.

    Args:
        scenes: read one after another; no more than the chosen clouds are kept.
        edges: of the strata of overlap, ascending.
        axes: name the random numbers; a scene's draw does not depend on the other scenes.
    """
    chosen: dict[str, list[ScanPair]] = {stratum_name(*ends): [] for ends in pairwise(edges)}
    for scene in scenes:
        by_stratum: dict[str, list] = {name: [] for name in chosen}
        for known in scene.known():
            if (name := stratum_of(known.overlap or 0.0, edges)) is not None:
                by_stratum[name].append(known)
        for name, candidates in by_stratum.items():
            order = generator(*axes, scene.name, name, "pairs").permutation(len(candidates))
            chosen[name] += [scene.pair(candidates[i]) for i in sorted(order[:most])]
    return [pair for pairs in chosen.values() for pair in pairs]
