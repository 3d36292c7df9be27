"""Pairs of scans in one file of a run: each scan once, and of each pair the scans, the pose and the overlap."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.io.arrays import REAL, TEXT, WHOLE, load_arrays, save_arrays
from gpca.io.names import Axes
from gpca.scans.pair import ScanPair

SHAPES: dict[str, tuple[int | str, ...]] = {
    "points": ("P", 3),  # of all scans one after another, in meters, each in its own frame
    "offsets": ("F1",),  # where each scan begins, and where the last one ends
    "scan": ("F",),  # name of each
    "viewpoint": ("F", 3),  # of each scan, m; 0 where it is not known
    "viewpoint_known": ("F",),
    "target": ("K",),  # of each pair, the number of the scan
    "source_scan": ("K",),
    "T_target_source": ("K", 4, 4),
    "overlap": ("K",),
    "scene": ("K",),
    "kind": ("K",),
    "size_m": ("K",),
    "cluster": ("K",),
}
KINDS = {
    "points": REAL,
    "offsets": WHOLE,
    "scan": TEXT,
    "viewpoint": REAL,
    "viewpoint_known": "b",
    "target": WHOLE,
    "source_scan": WHOLE,
    "T_target_source": REAL,
    "overlap": REAL,
    "scene": TEXT,
    "kind": TEXT,
    "size_m": REAL,
    "cluster": TEXT,
}


@dataclass(frozen=True)
class ScanPairs:
    """Pairs of scans of one data set and seed: ``for pair in ScanPairs.load(path)``, ``pairs[3]``, ``len(pairs)``.

    Attributes:
        arrays: by the names of `SHAPES`.
    """

    arrays: dict[str, np.ndarray]

    @property
    def cluster(self) -> np.ndarray:
        """What each pair (K,) is clustered and split by: its scene, or the family of that."""
        return self.arrays["cluster"]

    def __len__(self) -> int:
        return len(self.arrays["overlap"])

    def __iter__(self) -> Iterator[ScanPair]:
        return (self[k] for k in range(len(self)))

    def __getitem__(self, k: int) -> ScanPair:
        """Return pair number k; its points are float64."""
        of, (source, target) = self.arrays, (int(self.arrays[name][k]) for name in ("source_scan", "target"))
        return ScanPair(
            self._points(source),
            self._points(target),
            of["T_target_source"][k],
            overlap=float(of["overlap"][k]),
            scene=str(of["scene"][k]),
            kind="object" if of["kind"][k] == "object" else "room",
            size_m=float(of["size_m"][k]),
            source_name=str(of["scan"][source]),
            target_name=str(of["scan"][target]),
            source_viewpoint_3=self._viewpoint(source),
            target_viewpoint_3=self._viewpoint(target),
            family=str(of["cluster"][k]),
        )

    def _points(self, scan: int) -> np.ndarray:
        first, last = self.arrays["offsets"][scan : scan + 2]
        return self.arrays["points"][first:last].astype(np.float64)

    def _viewpoint(self, scan: int) -> np.ndarray | None:
        known = self.arrays["viewpoint_known"][scan]
        return self.arrays["viewpoint"][scan].astype(np.float64) if known else None

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
            {
                "points": np.concatenate([points for _, points, _ in scans]).astype(np.float32),
                "offsets": np.cumsum([0, *(len(points) for _, points, _ in scans)]),
                "scan": np.array([name for name, _, _ in scans]),
                "viewpoint": np.array([np.zeros(3) if at is None else at for _, _, at in scans], np.float64),
                "viewpoint_known": np.array([at is not None for _, _, at in scans]),
                "target": row_K_2[:, 1],
                "source_scan": row_K_2[:, 0],
                "T_target_source": np.array([pair.T_target_source for pair in pairs]),
                "overlap": np.array([pair.overlap for pair in pairs]),
                "scene": np.array([pair.scene for pair in pairs]),
                "kind": np.array([pair.kind for pair in pairs]),
                "size_m": np.array([pair.size_m for pair in pairs]),
                "cluster": np.array([pair.cluster for pair in pairs]),
            }
        )

    def save(self, path: str | Path, axes: Axes | None = None) -> None:
        """Write the file, of a data set and seed."""
        save_arrays(path, self.arrays, axes)

    @classmethod
    def load(cls, path: str | Path, axes: Axes | None = None) -> ScanPairs:
        """Read the file, and check it.

        Raises:
            InputError: what :func:`gpca.io.arrays.load_arrays` raises, or arrays that do not belong together.
        """
        arrays = load_arrays(path, SHAPES, KINDS, axes)
        offsets_F1, scans = arrays["offsets"], len(arrays["scan"])
        rows = np.concatenate([arrays["target"], arrays["source_scan"]])
        ends = len(offsets_F1) == scans + 1 and offsets_F1[0] == 0 and offsets_F1[-1] == len(arrays["points"])
        if not ends or (np.diff(offsets_F1) < 3).any() or (rows < 0).any() or (rows >= scans).any():
            raise InputError(path, "its pairs and scans do not belong together", "regenerate it with Snakemake")
        if not set(arrays["kind"].tolist()) <= {"room", "object"}:
            raise InputError(path, "has a scene that is neither a room nor an object", "regenerate it with Snakemake")
        return cls(arrays)
