"""Pairs of scans in one file of a run: each scan once, and of each pair the scans, the pose and the overlap."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.io.arrays import TEXT, WHOLE
from gpca.io.container import FLAG, Container, array
from gpca.scans.pair import ScanPair


@dataclass(frozen=True)
class ScanPairs(Container):
    """Pairs of scans of one data set and seed: ``for pair in ScanPairs.load(path)``, ``pairs[3]``, ``len(pairs)``.

    Attributes:
        points: (ΣN, 3) of all F scans one after another, in meters, each in its frame.
        offsets: (F + 1,) where each scan begins, and where the last one ends.
        scan: (F,) names.
        viewpoint, viewpoint_known: (F, 3) m, 0 where it is unknown, and (F,) whether it is known.
        target, source_scan: (K,) numbers of each pair's scans.
        T_target_source, overlap, scene, kind, size_m: (K, …) as in :class:`gpca.scans.pair.ScanPair`.
        cluster: (K,) what pairs are clustered and split by: the scene, or its family.
    """

    points: np.ndarray = array("P 3", offsets="offsets", fewest=3)
    offsets: np.ndarray = array("F+1", WHOLE)
    scan: np.ndarray = array("F", TEXT)
    viewpoint: np.ndarray = array("F 3")
    viewpoint_known: np.ndarray = array("F", FLAG)
    target: np.ndarray = array("K", WHOLE, least=0)
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
            self.part("points", source).astype(np.float64),
            self.part("points", target).astype(np.float64),
            self.T_target_source[k],
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
        pairs, rows = list(pairs), []
        number: dict[tuple[str, str], int] = {}
        scans: list[tuple[str, np.ndarray, np.ndarray | None]] = []
        for pair in pairs:
            for name, points, viewpoint in (
                (pair.source_name, pair.source_N_3, pair.source_viewpoint_3),
                (pair.target_name, pair.target_M_3, pair.target_viewpoint_3),
            ):
                if (pair.scene, name) not in number:
                    number[pair.scene, name] = len(scans)
                    scans.append((name, points, viewpoint))
            rows.append((number[pair.scene, pair.source_name], number[pair.scene, pair.target_name]))
        row_K_2 = np.array(rows, np.int64).reshape(-1, 2)
        return cls(
            points=np.concatenate([points for _, points, _ in scans]).astype(np.float32),
            offsets=np.cumsum([0, *(len(points) for _, points, _ in scans)]),
            scan=np.array([name for name, _, _ in scans]),
            viewpoint=np.array([np.zeros(3) if at is None else at for _, _, at in scans], np.float64),
            viewpoint_known=np.array([at is not None for _, _, at in scans]),
            target=row_K_2[:, 1],
            source_scan=row_K_2[:, 0],
            T_target_source=np.array([pair.T_target_source for pair in pairs]),
            overlap=np.array([pair.overlap for pair in pairs]),
            scene=np.array([pair.scene for pair in pairs]),
            kind=np.array([pair.kind for pair in pairs]),
            size_m=np.array([pair.size_m for pair in pairs]),
            cluster=np.array([pair.cluster for pair in pairs]),
        )

    def check(self, path: str | Path) -> None:
        """Raise an InputError also where a pair names a scan that the file lacks."""
        super().check(path)
        if (np.concatenate([self.target, self.source_scan]) >= len(self.scan)).any():
            raise InputError(path, "its pairs and scans do not belong together", self.remedy)
