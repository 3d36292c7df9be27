"""Scenes scanned from several places, the choice of their pairs, and the file that holds the pairs of a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.io.arrays import TEXT, WHOLE
from gpca.io.container import FLAG, Container, array
from gpca.rigid import inverse, transform
from gpca.scans.pair import OVERLAP_M, ROOM_M, VOXEL_M, Kind, ScanPair, near, voxels
from gpca.seeds import generator


@dataclass(frozen=True)
class Scan:
    """Points (N, 3) in the frame of their sensor, in meters."""

    points_N_3: np.ndarray
    T_scene_scan: np.ndarray | None = None  # None where only poses of pairs are known
    viewpoint_3: np.ndarray | None = None  # of the sensor in the frame of the points; None where unknown


@dataclass(frozen=True)
class Known:
    """The overlap in [0, 1] and true pose of a pair of scans, by their names; None where they are not published."""

    target: str
    source: str
    overlap: float | None = None
    T_target_source: np.ndarray | None = None


@dataclass(frozen=True)
class ScannedScene:
    """A scene that was scanned from several places."""

    name: str
    kind: Kind
    scans: Mapping[str, Scan]  # by name, in order
    printed: tuple[Known, ...] = ()  # the pairs that the data set lists; if empty, all pairs of scans
    family: str = ""  # as of `ScanPair`

    def __post_init__(self) -> None:
        if len(self.scans) < 2:
            raise InputError(f"scene {self.name}", f"has {len(self.scans)} scans", "give at least two")
        for name in (name for pair in self.printed for name in (pair.target, pair.source)):
            if name not in self.scans:
                raise InputError(f"scene {self.name}", f"lists a pair with scan '{name}'", "add that scan")

    @cached_property
    def size_m(self) -> float:
        """The diagonal of the box around all scans; of a room `ROOM_M`, as nothing reads it."""
        if self.kind == "room":
            return ROOM_M
        moved = [transform(self._pose(name), scan.points_N_3) for name, scan in self.scans.items()]
        corners = [corner for points in moved for corner in (points.min(axis=0), points.max(axis=0))]
        return float(np.linalg.norm(np.ptp(np.stack(corners), axis=0)))

    def known(self) -> Iterator[Known]:
        """Yield every pair with its pose and its overlap, published or measured as for 3DMatch (Huang et al. 2021)."""
        scale, thin = self.size_m / ROOM_M, dict[str, np.ndarray]()
        for pair in self.printed or (Known(*names) for names in combinations(self.scans, 2)):
            T_target_source = self._relative(pair)
            if (share := pair.overlap) is None:
                for name in {pair.source, pair.target} - thin.keys():
                    thin[name] = voxels(self.scans[name].points_N_3, VOXEL_M * scale)
                source_m_3 = transform(T_target_source, thin[pair.source])
                share = float(near(thin[pair.target], source_m_3, OVERLAP_M * scale).mean())
            yield Known(pair.target, pair.source, share, T_target_source)

    def pair(self, known: Known) -> ScanPair:
        """Return a pair with its clouds."""
        source, target = self.scans[known.source], self.scans[known.target]
        return ScanPair(
            source_N_3=source.points_N_3,
            target_M_3=target.points_N_3,
            T_target_source=self._relative(known),
            overlap=float("nan") if known.overlap is None else known.overlap,
            scene=self.name,
            kind=self.kind,
            size_m=self.size_m,
            source_name=known.source,
            target_name=known.target,
            source_viewpoint_3=source.viewpoint_3,
            target_viewpoint_3=target.viewpoint_3,
            family=self.family,
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
    return f"overlap_{low:g}_{high:g}"


def stratum_of(overlap: float, edges: Sequence[float]) -> str | None:
    """Return the stratum of an overlap, the upper edge of the last one included; None where it is in none."""
    for low, high in pairwise(edges):
        if low <= overlap < high or (overlap == high == edges[-1]):
            return stratum_name(low, high)
    return None


def choose_pairs(scenes: Iterable[ScannedScene], edges: Sequence[float], most: int, *axes: object) -> list[ScanPair]:
    """Return up to `most` pairs of each stratum and scene, drawn by the axes and by no other scene."""
    chosen: dict[str, list[ScanPair]] = {stratum_name(*ends): [] for ends in pairwise(edges)}
    for scene in scenes:
        by_stratum: dict[str, list] = {name: [] for name in chosen}
        for known in scene.known():
            if (name := stratum_of(known.overlap or 0.0, edges)) is not None:
                by_stratum[name].append(known)
        for name, candidates in by_stratum.items():
            order = generator(*axes, scene.name, name, "pairs").permutation(len(candidates))
            share = max(1.0, len(candidates) / most)
            chosen[name] += [replace(scene.pair(candidates[i]), stands_for=share) for i in sorted(order[:most])]
    return [pair for pairs in chosen.values() for pair in pairs]


PER_PAIR = ("T_target_source", "overlap", "scene", "kind", "size_m", "cluster")  # as in ScanPair


@dataclass(frozen=True)
class ScanPairs(Container):
    """Pairs of scans of one data set and seed: ``for pair in ScanPairs.load(path)``, ``pairs[3]``, ``len(pairs)``."""

    points: np.ndarray = array("P 3", offsets="offsets", fewest=3)  # m, of one scan after another, each in its frame
    offsets: np.ndarray = array("F+1", WHOLE)
    scan: np.ndarray = array("F", TEXT)  # names
    viewpoint: np.ndarray = array("F 3")  # m; 0 where unknown
    viewpoint_known: np.ndarray = array("F", FLAG)
    target: np.ndarray = array("K", WHOLE, least=0)  # numbers of its scans
    source_scan: np.ndarray = array("K", WHOLE, least=0)
    T_target_source: np.ndarray = array("K 4 4")
    overlap: np.ndarray = array("K")
    scene: np.ndarray = array("K", TEXT)
    kind: np.ndarray = array("K", TEXT, choices=("room", "object"))
    size_m: np.ndarray = array("K")
    cluster: np.ndarray = array("K", TEXT)

    def __len__(self) -> int:
        return len(self.overlap)

    def __iter__(self) -> Iterator[ScanPair]:
        return (self[k] for k in range(len(self)))

    def __getitem__(self, k: int) -> ScanPair:
        """Return pair number k; its points are float64."""
        source, target = int(self.source_scan[k]), int(self.target[k])
        return ScanPair(
            source_N_3=self.part("points", source).astype(np.float64),
            target_M_3=self.part("points", target).astype(np.float64),
            T_target_source=self.T_target_source[k],
            overlap=float(self.overlap[k]),
            scene=str(self.scene[k]),
            kind="object" if self.kind[k] == "object" else "room",
            size_m=float(self.size_m[k]),
            source_name=str(self.scan[source]),
            target_name=str(self.scan[target]),
            source_viewpoint_3=self._viewpoint(source),
            target_viewpoint_3=self._viewpoint(target),
            family=str(self.cluster[k]),
        )

    def _viewpoint(self, scan: int) -> np.ndarray | None:
        return self.viewpoint[scan].astype(np.float64) if self.viewpoint_known[scan] else None

    @classmethod
    def of(cls, pairs: Iterable[ScanPair]) -> ScanPairs:
        """Collect pairs; a scan that several of a scene share is kept once."""
        pairs = list(pairs)
        scans: dict[tuple[str, str], tuple[np.ndarray, np.ndarray | None]] = {}  # by scene and name
        for pair in pairs:
            scans.setdefault((pair.scene, pair.source_name), (pair.source_N_3, pair.source_viewpoint_3))
            scans.setdefault((pair.scene, pair.target_name), (pair.target_M_3, pair.target_viewpoint_3))
        number = {scan: i for i, scan in enumerate(scans)}
        points, viewpoints = zip(*scans.values(), strict=True)
        return cls(
            points=np.concatenate(points).astype(np.float32),
            offsets=np.cumsum([0, *map(len, points)]),
            scan=np.array([name for _, name in scans]),
            viewpoint=np.array([np.zeros(3) if at is None else at for at in viewpoints], np.float64),
            viewpoint_known=np.array([at is not None for at in viewpoints]),
            target=np.array([number[pair.scene, pair.target_name] for pair in pairs]),
            source_scan=np.array([number[pair.scene, pair.source_name] for pair in pairs]),
            **{name: np.array([getattr(pair, name) for pair in pairs]) for name in PER_PAIR},  # type: ignore[arg-type]
        )

    def check(self, path: str | Path) -> None:
        """Raise an InputError also where a pair names a scan that the file lacks."""
        super().check(path)
        if (np.concatenate([self.target, self.source_scan]) >= len(self.scan)).any():
            raise InputError(path, "its pairs and scans do not belong together", self.remedy)
