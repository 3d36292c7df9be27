"""Two scans of one scene and their true pose: overlap, disturbed starts, and when a registration is correct."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from scipy.spatial import cKDTree

from gpca.errors import InputError
from gpca.rigid import random_direction, require_rigid, rigid_motion, rotate, transform
from gpca.seeds import generator
from gpca.settings import Bounds, NotNegative, Positive, PositiveShare

Kind = Literal["room", "object"]
VOXEL_M = 0.025  # in a room: the voxels of 3DMatch's benchmark
MOST_CELLS = 2.0**62
FEWEST_COMMON = 3  # points
ROOM_M = 3.0  # the usual size of a fragment of a room: objects are registered as if they were as large
OVERLAP_M = 0.0375  # in a room: how close a point of the other scan counts as the same surface (Predator's 3DMatch)


@dataclass(frozen=True)
class ScanPair:
    """Two scans of one scene, in meters, each in its sensor's frame; InputError for points or a pose that are none."""

    source_N_3: np.ndarray
    target_M_3: np.ndarray
    T_target_source: np.ndarray
    overlap: float  # share of the target's points that the source has, in (0, 1], published or measured
    scene: str
    kind: Kind = "room"
    size_m: float = ROOM_M  # diagonal of the box around all scans of the scene; unused for a room
    source_name: str = "source"
    target_name: str = "target"
    source_viewpoint_3: np.ndarray | None = None  # of the sensor, to which normals point; None where unknown
    target_viewpoint_3: np.ndarray | None = None
    family: str = ""  # of scenes that are alike, as two data sets of one object
    stands_for: float = 1.0  # pairs of its data set, from which it is drawn

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
        """Scene, target and source, which name random numbers: ``kitchen/0/3``."""
        return f"{self.scene}/{self.target_name}/{self.source_name}"

    @property
    def cluster(self) -> str:
        """The family, or else the scene, by which pairs are clustered and split."""
        return self.family or self.scene

    @property
    def scale(self) -> float:
        """Factor from the settings for rooms to those for this pair: 1 in rooms."""
        return 1.0 if self.kind == "room" else self.size_m / ROOM_M

    @property
    def unit_m(self) -> float:
        """The length that counts as the diameter of whole objects does: the usual size of a scan."""
        return ROOM_M * self.scale

    @property
    def middle_3(self) -> np.ndarray:
        """The middle of the box around the target, in meters."""
        return (self.target_M_3.min(axis=0).astype(np.float64) + self.target_M_3.max(axis=0)) / 2

    @property
    def overlap_m(self) -> float:
        """The distance within which points of both scans count as the same surface."""
        return OVERLAP_M * self.scale

    @cached_property
    def source_common_N(self) -> np.ndarray:
        """Which points (N,) of the source lie on surface of the target, at the true pose."""
        return near(transform(self.T_target_source, self.source_N_3), self.target_M_3, self.overlap_m)

    @cached_property
    def target_common_M(self) -> np.ndarray:
        """Which points (M,) of the target lie on surface of the source, at the true pose."""
        return near(self.target_M_3, transform(self.T_target_source, self.source_N_3), self.overlap_m)


def near(points_N_3: np.ndarray, others_M_3: np.ndarray, distance: float) -> np.ndarray:
    """Return which points (N,) are within a distance of any of the others."""
    nearest_N, _ = cKDTree(others_M_3).query(points_N_3, distance_upper_bound=distance)
    return np.isfinite(nearest_N)


def voxels(points_N_3: np.ndarray, edge: float) -> np.ndarray:
    """Return the mean (n, 3) of the points in each cube of a grid, sorted by cube; InputError for too many cubes."""
    points_N_3 = np.asarray(points_N_3, np.float64)
    cell_N_3 = np.floor((points_N_3 - points_N_3.min(axis=0)) / edge)
    sizes_3 = cell_N_3.max(axis=0) + 1
    if sizes_3.prod() > MOST_CELLS:
        fault = f"spans {np.ptp(points_N_3, axis=0).max():.3g} m, too much for voxels of {edge:.3g} m"
        raise InputError("scan", fault, "correct its unit, or leave out points that are far away")
    key_N = np.ravel_multi_index(cell_N_3.astype(np.int64).T, sizes_3.astype(np.int64))
    _, of_cell_N, count_n = np.unique(key_N, return_inverse=True, return_counts=True)
    sums = [np.bincount(of_cell_N.ravel(), weights=axis) for axis in points_N_3.T]
    return np.stack(sums, axis=1) / count_n[:, None]


@dataclass(frozen=True)
class Rung:
    """A disturbance of a pose: a turn about a random axis through the middle of the source, and a shift."""

    rotation_deg: Annotated[float, Bounds(minimum=0, maximum=180)]
    translation_m: NotNegative  # in a random direction; for objects, times `ScanPair.scale`

    @property
    def name(self) -> str:
        """E.g. ``20deg_0.25m``."""
        return f"{self.rotation_deg:g}deg_{self.translation_m:g}m"


def rungs_of(pairs: int, ladder: Sequence[Rung], *axes: object) -> list[Rung]:
    """Return the rung of each pair: each run of as many pairs as rungs has every rung once, in a random order."""
    random, order = generator(*axes, "rungs"), list[int]()
    while len(order) < pairs:
        order += random.permutation(len(ladder)).tolist()
    return [ladder[i] for i in order[:pairs]]


def disturbed(pair: ScanPair, rung: Rung, *axes: object) -> np.ndarray:
    """Return ``T_target_source`` (4×4) of a start on a rung; axes, pair and rung name the random numbers."""
    from scipy.spatial.transform import Rotation

    random = generator(*axes, pair.name, rung.name, "start")
    R = Rotation.from_rotvec(np.deg2rad(rung.rotation_deg) * random_direction(random)).as_matrix()
    middle_3 = rotate(pair.T_target_source, pair.source_N_3.mean(axis=0)) + pair.T_target_source[:3, 3]
    shift_3 = rung.translation_m * pair.scale * random_direction(random)
    return rigid_motion(R, middle_3 - rotate(R, middle_3) + shift_3) @ pair.T_target_source


@dataclass(frozen=True)
class ScanSuccess:
    """Limits of the RMSE over the true overlap, above which a registration has failed (3DMatch, Zeng et al. 2017)."""

    room_m: Positive = 0.2  # in rooms
    object_share: PositiveShare = 0.02  # of objects, relative to their size

    def limit_m(self, pair: ScanPair) -> float:
        """Return the limit of a pair, in meters."""
        return self.room_m if pair.kind == "room" else self.object_share * pair.size_m


def overlap_rmse(pair: ScanPair, T_target_source: np.ndarray) -> float:
    """Return the RMSE (m) of the source's common points, or of all if fewer than three, from their true places."""
    common_N = pair.source_common_N
    points_n_3 = pair.source_N_3[common_N] if common_N.sum() >= FEWEST_COMMON else pair.source_N_3
    moved_n_3 = transform(T_target_source, points_n_3) - transform(pair.T_target_source, points_n_3)
    return float(np.sqrt(np.square(moved_n_3).sum(axis=1).mean()))
