"""Two scans of one scene and their true pose: what is registered, and what a result is judged by."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.rigid import require_rigid, transform
from gpca.errors import InputError

Kind = Literal["room", "object"]
ROOM_M = 3.0  # the usual size of a fragment of a room: objects are registered as if they were as large
OVERLAP_M = 0.0375  # in a room: how close a point of the other scan counts as the same surface (Predator's 3DMatch)


@dataclass(frozen=True)
class ScanPair:
    """Two scans of one scene, in meters, each in the frame of its own sensor.

    Attributes:
        source_N_3, target_M_3: points as they were measured; their numbers differ.
        T_target_source: the true pose (4×4).
        overlap: share of the target's points that the source has as well, in (0, 1]: printed by the data set, or else
            :func:`gpca.scans.overlap.overlap`.
        scene: its name.
        kind: whether the scene is a room or an object.
        size_m: diagonal of the box around all scans of the scene; of a room it has no use.
        source_name, target_name: of the scans in the scene.
        source_viewpoint_3, target_viewpoint_3: where the sensor stood, each in the frame of its scan; None where it is
            not known. Normals point there.
        family: scenes of one family are alike, as two data sets of one object; the scene itself if empty.

    Raises:
        InputError: fewer than three points, NaN, a pose that is not rigid, or a size that is not positive.
    """

    source_N_3: np.ndarray
    target_M_3: np.ndarray
    T_target_source: np.ndarray
    overlap: float
    scene: str
    kind: Kind = "room"
    size_m: float = ROOM_M
    source_name: str = "source"
    target_name: str = "target"
    source_viewpoint_3: np.ndarray | None = None
    target_viewpoint_3: np.ndarray | None = None
    family: str = ""

    def __post_init__(self) -> None:
        for name, points in ((self.source_name, self.source_N_3), (self.target_name, self.target_M_3)):
            if points.ndim != 2 or points.shape[1] != 3 or len(points) < 3 or not np.isfinite(points).all():
                fault = f"has shape {points.shape} or contains NaN"
                raise InputError(f"scan '{name}' of {self.scene}", fault, "give at least 3 finite points (N, 3)")
        require_rigid(self.T_target_source, f"pose of {self.source_name} in {self.target_name}, {self.scene}")
        if not self.size_m > 0:
            raise InputError(f"scene {self.scene}", "has no extent", "give scans of more than one place")

    @property
    def name(self) -> str:
        """Scene, target and source, by which random numbers are named: ``kitchen/0/3``."""
        return f"{self.scene}/{self.target_name}/{self.source_name}"

    @property
    def cluster(self) -> str:
        """What pairs are clustered and split by: the family, or else the scene."""
        return self.family or self.scene

    @property
    def scale(self) -> float:
        """Meters here to a meter of a room: 1 in rooms; settings for rooms hold for objects when multiplied by it."""
        return 1.0 if self.kind == "room" else self.size_m / ROOM_M

    @property
    def overlap_m(self) -> float:
        """How close a point of the other scan counts as the same surface."""
        return OVERLAP_M * self.scale

    @cached_property
    def source_common_N(self) -> np.ndarray:
        """Which points (N,) of the source lie on surface that the target has as well, at the true pose."""
        return near(transform(self.T_target_source, self.source_N_3), self.target_M_3, self.overlap_m)

    @cached_property
    def target_common_M(self) -> np.ndarray:
        """Which points (M,) of the target lie on surface that the source has as well, at the true pose."""
        return near(self.target_M_3, transform(self.T_target_source, self.source_N_3), self.overlap_m)


def near(points_N_3: np.ndarray, others_M_3: np.ndarray, distance: float) -> np.ndarray:
    """Return which points (N,) have one of the others within the distance; both in one frame and unit."""
    nearest_N, _ = cKDTree(others_M_3).query(points_N_3, distance_upper_bound=distance)
    return np.isfinite(nearest_N)
