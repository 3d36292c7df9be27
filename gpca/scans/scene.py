"""A scene that was scanned from several places: its scans, and what is known of pairs of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from gpca.alignment.rigid import inverse, transform
from gpca.errors import InputError
from gpca.scans.overlap import VOXEL_M, overlap_of_voxels, voxels
from gpca.scans.pair import ROOM_M, Kind, ScanPair

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
