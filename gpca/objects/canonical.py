"""Surfaces into canonical clouds, and the folds of their clusters (families or scenes), one of which is unseen."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gpca.errors import InputError
from gpca.io.arrays import REGENERATE, TEXT, WHOLE
from gpca.io.container import Container, array
from gpca.io.csv_file import read_csv
from gpca.io.files import is_name
from gpca.objects.sizes import LARGEST_DIAMETER_M, SMALLEST_DIAMETER_M, require_size
from gpca.objects.surface import Surface, instance_of, meters_per
from gpca.process.environment import open3d_cloud, require_open3d
from gpca.seeds import generator

FEWEST_CLOUD_POINTS = 64
NORMAL_NEIGHBORS = 30
MEASURED_POINTS = 10_000  # at most, that determine the frame: all points of a cloud may lie on its hull
# A cloud spans nearly its object's diameter. Few points miss some of it, but never nine tenths.
SMALLEST_EXTENT = 0.1  # diameters
UNIT_TOLERANCE = 1e-3  # of the length of a normal, a hundred times what float32 rounds
NEARLY = 0.1  # steps by which rounded numbers may be off; other numbers are up to half a step off
COARSEST = 0.01  # maximum quantization step, as a share of the extent
FEW_POINTS = 600  # up to this many, all distances take less time than the hull


def require_points(points: np.ndarray, subject: object) -> None:
    """Raise InputError unless `points` is (P, 3), P > 0, finite, and not rounded away by a large offset."""
    if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0:
        raise InputError(subject, "has no points", "fetch or export it again")
    if bad := int((~np.isfinite(points)).any(axis=1).sum()):
        raise InputError(subject, f"{bad} of {len(points)} points contain NaN or infinity", "fetch or export it again")
    extent, largest_3 = np.linalg.norm(np.ptp(points, axis=0)), np.abs(points).max(axis=0)
    for kind in (np.float32, np.float64):
        with np.errstate(all="ignore"):  # float32 does not hold all that float64 does
            step_3 = np.spacing(largest_3.astype(kind)).astype(np.float64)
            coarse_3 = step_3 > COARSEST * extent
            # Files of text do not write all digits.
            off = np.abs(points[:, coarse_3].astype(kind) - points[:, coarse_3]) / step_3[coarse_3]
            rounded = (off < NEARLY).all()
        if extent > 0 and coarse_3.any() and rounded:
            steps = f"at coordinates of {largest_3.max():.3g}, {kind.__name__} has steps of {step_3.max():.2g}"
            remedy = "subtract an offset before saving it, from source and target alike"
            raise InputError(subject, f"{steps}, but all points span {extent:.2g}", remedy)


def diameter(points: np.ndarray, subject: object) -> float:
    """Return the largest distance between two of the points (P, 3), as BOP has it; InputError for points on a line."""
    from scipy.spatial import ConvexHull
    from scipy.spatial.distance import cdist, pdist

    require_points(points, subject)
    centered = points - points.mean(axis=0)
    extents, axes = np.linalg.svd(centered, full_matrices=False)[1:]
    rank = int((extents > 1e-6 * extents[0]).sum())
    if rank < 2:
        raise InputError(subject, "all its points coincide or lie on one line", "an object needs a surface")
    if len(points) <= FEW_POINTS:
        return float(pdist(points).max())
    # In the plane or space that the points span: Qhull refuses a flat cloud in 3-D.
    hull = points[ConvexHull(centered @ axes[:rank].T).vertices]
    blocks = np.array_split(hull, len(hull) // 1024 + 1)  # a sphere has thousands of hull vertices: bounded memory
    return float(max(cdist(block, hull).max() for block in blocks))


def canonical_cloud(surface: Surface, source: str, n_points: int = 16384) -> tuple[np.ndarray, np.ndarray, float]:
    """Return points and unit normals (P, 3) float32 of a surface, centered on its bounding box, and its diameter (m).

    A mesh gives `n_points` area-uniform samples; a cloud keeps all its points, in random order.
    """
    subject = f"{source}: object '{surface.name}'"
    vertices_m = np.asarray(surface.vertices_m, dtype=np.float64)
    require_points(vertices_m, subject)
    if (count := len(vertices_m) if surface.faces is None else n_points) < FEWEST_CLOUD_POINTS:
        raise InputError(subject, f"has {count} point(s)", f"give {FEWEST_CLOUD_POINTS} or more")
    if surface.faces is not None and not np.abs(_area_vectors(vertices_m, surface.faces)).sum() > 0:
        raise InputError(subject, "the mesh has no area", "export it again with its faces")
    diameter_m = diameter(_used_vertices(surface), subject)
    require_size(diameter_m, subject)
    random = generator(source, surface.name, "surface")
    if surface.faces is None:
        order = random.permutation(len(vertices_m))
        normals = normals_towards_camera(surface.vertices_m) if surface.normals is None else surface.normals
        points_m, normals = surface.vertices_m[order], normals[order]
    else:
        points_m, face = sample_surface(vertices_m, surface.faces, n_points, random)
        normals = _area_vectors(surface.vertices_m, surface.faces[face])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    centered_m = np.asarray(points_m) - bounding_center(surface)
    return centered_m.astype(np.float32), normals.astype(np.float32), diameter_m


def bounding_center(surface: Surface) -> np.ndarray:
    """Return the center (3,) of a surface's upright bounding box in meters: the origin of its canonical cloud."""
    used_m = _used_vertices(surface)
    return (used_m.min(axis=0) + used_m.max(axis=0)) / 2


def _used_vertices(surface: Surface) -> np.ndarray:
    vertices_m = np.asarray(surface.vertices_m, dtype=np.float64)
    # Vertices that no face uses are no surface.
    return vertices_m if surface.faces is None else vertices_m[np.unique(surface.faces)]


def sample_surface(
    vertices_m: np.ndarray, faces: np.ndarray, n_points: int, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Draw points (P, 3) uniformly from the area of a mesh, and return the face of each; trimesh draws the same."""
    a_F_3, b_F_3, c_F_3 = (vertices_m[faces[:, corner]] for corner in range(3))
    sum_F = np.cumsum(np.sqrt((np.cross(b_F_3 - a_F_3, c_F_3 - b_F_3) ** 2).sum(axis=1)) / 2)
    face_P = np.searchsorted(sum_F, random.random(n_points) * sum_F[-1])
    along_P_2_1 = random.random((n_points, 2, 1))
    along_P_2_1[along_P_2_1.sum(axis=1)[:, 0] > 1.0] -= 1.0  # the other half of the parallelogram
    edges_P_2_3 = np.stack([(b_F_3 - a_F_3)[face_P], (c_F_3 - a_F_3)[face_P]], axis=1)
    return (edges_P_2_3 * np.abs(along_P_2_1)).sum(axis=1) + a_F_3[face_P], face_P


def _area_vectors(vertices_m: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = (vertices_m[faces[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)


def normals_towards_camera(points_m: np.ndarray) -> np.ndarray:
    """Return unit normals (P, 3) from nearest neighbors, turned toward a camera at the origin."""
    cloud = open3d_cloud(points_m)
    cloud.estimate_normals(require_open3d().geometry.KDTreeSearchParamKNN(NORMAL_NEIGHBORS))
    cloud.orient_normals_towards_camera_location(np.zeros(3))
    return np.asarray(cloud.normals)


@dataclass(frozen=True)
class CanonicalFrame:
    """The origin, the center of the axis-aligned bounding box, and the unit, the diameter."""

    center_3: np.ndarray
    diameter: float

    @classmethod
    def of(cls, points: np.ndarray, unit: str | None = "m", subject: object = "target") -> CanonicalFrame:
        """Measure the points (N, 3) of a target, of any size without a unit; `subject` names it in messages."""
        require_cloud_points(points, subject)
        points = thin(points, MEASURED_POINTS, "frame")
        size = diameter(points, subject)
        if unit is not None:
            require_size(size * meters_per(unit), subject, unit)
        return cls((points.min(axis=0) + points.max(axis=0)) / 2, size)

    def coordinates(self, points: np.ndarray) -> np.ndarray:
        """Return points (N, 3) in this frame."""
        return (points - self.center_3) / self.diameter

    def pose_inside(self, T_b_a: np.ndarray) -> np.ndarray:
        """Return a motion (4, 4) of the original frame and unit in this frame."""
        inside = T_b_a.copy()
        inside[:3, 3] = (T_b_a[:3, 3] + T_b_a[:3, :3] @ self.center_3 - self.center_3) / self.diameter
        return inside

    def pose_outside(self, T_b_a: np.ndarray) -> np.ndarray:
        """Return a motion (4, 4) of this frame in the original frame and unit."""
        outside = T_b_a.copy()
        outside[:3, 3] = self.diameter * T_b_a[:3, 3] + self.center_3 - T_b_a[:3, :3] @ self.center_3
        return outside


def require_cloud_points(points: np.ndarray, subject: object) -> None:
    """Raise an InputError unless the points are (N, 3), finite, and enough for the encoders."""
    require_points(points, subject)
    few = len(points) < 100 * FEWEST_CLOUD_POINTS  # more need not be counted
    count = len(np.unique(points, axis=0)) if few else len(points)
    if len(points) < FEWEST_CLOUD_POINTS or 1 < count < FEWEST_CLOUD_POINTS:  # a single place has a line of its own
        held = f"{len(points)} points" if count in (1, len(points)) else f"{count} distinct points"
        raise InputError(subject, f"has {held}", f"give {FEWEST_CLOUD_POINTS} or more")


def thin(points: np.ndarray, most: int, *axes: object) -> np.ndarray:
    """Return the points (N, 3), or `most` of them drawn at random; the axes name the seed."""
    if len(points) <= most:
        return points
    return points[generator("thinned", *axes).choice(len(points), most, replace=False, shuffle=False)]


def write_objects(
    surfaces: Iterable[Surface], source: str, path: str | Path, n_points: int = 16384, splits: Path | None = None
) -> None:
    """Write the canonical clouds of a source, whole or not at all; `splits` is a file of families and folds."""
    places = read_object_splits(splits, source) if splits else {}

    def is_used(surface: Surface) -> bool:
        if surface.name not in places:
            remedy = "add it to the file of objects, or set splits.objects: null"
            raise InputError(f"object '{surface.name}'", "is in no split", remedy)
        return places[surface.name].role != UNUSED

    objects = sample_objects(filter(is_used, surfaces) if places else surfaces, source, n_points)
    if places:
        families, folds = zip(*((places[name].cluster, places[name].fold) for name in objects.names), strict=True)
        objects = replace(objects, families=np.array(families), folds=np.array(folds))
    objects.save(path, source)


def sample_objects(surfaces: Iterable[Surface], source: str, n_points: int = 16384) -> ObjectClouds:
    """Return the canonical clouds of a source; InputError as in :func:`write_objects`."""
    sampled: dict[str, tuple[np.ndarray, np.ndarray, float]] = {}
    for surface in surfaces:
        if not is_name(surface.name):
            fault = "its name is empty or does not fit on one line"
            raise InputError(f"{source}: object {surface.name!r}", fault, "rename it")
        if surface.name in sampled:
            raise InputError(f"{source}: object '{surface.name}'", "occurs twice", "give each file its own name")
        sampled[surface.name] = canonical_cloud(surface, source, n_points)
    if not sampled:
        raise InputError(source, "the source has no object", "check its location and files")
    points_m, normals, diameters_m = zip(*sampled.values(), strict=True)
    return ObjectClouds(
        names=np.array(list(sampled)),
        points_m=np.concatenate(points_m),
        normals=np.concatenate(normals),
        offsets=np.cumsum([0, *map(len, points_m)], dtype=np.int64),
        diameters_m=np.array(diameters_m),
        families=np.array([instance_of(name) for name in sampled]),
        folds=np.full(len(sampled), DRAWN),
    )


@dataclass(frozen=True)
class ObjectClouds(Container):
    """The canonical clouds of the O objects of one source, as :func:`write_objects` wrote them."""

    names: np.ndarray = array("O", TEXT)
    points_m: np.ndarray = array("P 3", offsets="offsets")  # float32, each centered on the object's bounding box
    normals: np.ndarray = array("P 3", offsets="offsets")  # float32, of unit length
    offsets: np.ndarray = array("O+1", WHOLE)
    diameters_m: np.ndarray = array("O", least=SMALLEST_DIAMETER_M, most=LARGEST_DIAMETER_M)
    families: np.ndarray = array("O", TEXT)  # from a file of splits; without one, each instance is a family
    folds: np.ndarray = array("O", WHOLE)  # that leave an object unseen; `DRAWN` where no file has them

    @classmethod
    def load(cls, path: str | Path, source: str | None = None) -> ObjectClouds:  # type: ignore[override]
        """Read an objects npz, of this source if one is given."""
        return super().load(path, (source, None) if source else None)

    def save(self, path: str | Path, source: str) -> None:  # type: ignore[override]
        """Write the objects npz, and list the objects on stderr."""
        super().save(path, (source, None))
        for name, points, diameter_m in zip(self.names, np.diff(self.offsets), self.diameters_m, strict=True):
            print(f"{source}: {name}: {points} points, {1e3 * diameter_m:.1f} mm", file=sys.stderr)

    def check(self, path: str | Path) -> None:
        """Raise an InputError also where a name occurs twice, or points and normals are no canonical cloud."""
        super().check(path)
        if len(set(self.names.tolist())) < len(self):
            raise InputError(path, "contains two objects with the same name", REGENERATE)
        for i, diameter_m in enumerate(self.diameters_m):
            subject = f"{path}, object '{self.names[i]}'"
            # From the center of its box, no point of an object is farther away than its diameter.
            extent_m = float(np.linalg.norm(np.ptp(self.points(i), axis=0)))
            if np.abs(self.points(i)).max() > diameter_m or extent_m < SMALLEST_EXTENT * diameter_m:
                fault = f"its points span {extent_m:.4g} m, its diameter is {diameter_m:.4g} m"
                raise InputError(subject, f"{fault}, or they are not centered", REGENERATE)
            if np.abs(np.linalg.norm(self.normals_of(i), axis=1) - 1).max() > UNIT_TOLERANCE:
                raise InputError(subject, "a normal is not of unit length", REGENERATE)

    def points(self, i: int) -> np.ndarray:
        """(P, 3) float32, meters, centered on the object's bounding box."""
        return self.part("points_m", i)

    def normals_of(self, i: int) -> np.ndarray:
        """(P, 3) float32 unit normals."""
        return self.part("normals", i)

    def row(self, name: str) -> int:
        """Return the number of an object."""
        return self.names.tolist().index(name)


DRAWN = -1  # the fold of what no file deals into folds
TRAINING = -2  # the fold of scenes for development, which are never tested but may be trained on
DEVELOPMENT, EVALUATION, UNUSED = ROLES = ("development", "evaluation", "unused")
ANNOTATED, BY_ICP = TRUTHS = ("annotated", "icp")
ON_IMAGE, CARRIED = ESTIMATES = ("image", "carried")


class Place(NamedTuple):
    """The cluster, role and fold of an object or a scene, and where the poses of a scene are from."""

    cluster: str
    role: str
    fold: int
    truth: str = ANNOTATED
    estimates: str = ON_IMAGE


def read_object_splits(path: str | Path, source: str) -> dict[str, Place]:
    """Return the place of each object of a source by name; none where the file does not name the source."""
    rows = read_csv(path, ("source", "object", "name", "family", "role", "fold"), remedy="restore it")
    rows = rows[rows["source"] == source]
    return _places(path, rows["object"], rows["family"], rows["role"], rows["fold"])


def read_scene_splits(path: str | Path, dataset: str) -> dict[int, Place]:
    """Return the place of each scene of a dataset by number; none where the file does not name the dataset."""
    rows = read_csv(path, ("dataset", "scene", "role", "fold"), others=("truth", "estimates"), remedy="restore it")
    rows = rows[rows["dataset"] == dataset]
    clusters = [f"{dataset} {scene}" for scene in rows["scene"]]
    places = _places(path, rows["scene"], clusters, rows["role"], rows["fold"])
    for column, words in {"truth": TRUTHS, "estimates": ESTIMATES}.items():
        for scene, word in zip(rows["scene"], rows.get(column, ()), strict=False):
            if word not in words:
                fault = f"scene {scene} of {dataset} has '{word}' as {column}"
                raise InputError(path, fault, f"choose one of {', '.join(words)}")
            places[scene] = places[scene]._replace(**{column: word})
    return {int(scene): place for scene, place in places.items()}


def _places(path, names, clusters, roles, folds) -> dict[str, Place]:
    places, by_cluster = dict[str, Place](), dict[str, Place]()
    for name, cluster, role, fold in zip(names, clusters, roles, folds, strict=True):
        if name in places:
            raise InputError(path, f"'{name}' occurs twice", "keep one of its rows")
        if role not in ROLES:
            raise InputError(path, f"'{name}' has the role '{role}'", f"choose one of {', '.join(ROLES)}")
        if not fold.isdecimal() and role != UNUSED:
            raise InputError(path, f"'{name}' has the fold '{fold}'", "number the folds from 0")
        place = Place(cluster, role, int(fold) if role != UNUSED else DRAWN)
        if place != by_cluster.setdefault(cluster, place):
            raise InputError(path, f"'{cluster}' has two roles or is in two folds", "give all of it one of each")
        places[name] = place
    return places


def unseen(fold_N: np.ndarray, seed: int) -> np.ndarray | None:
    """Return the rows (N,) of the fold that a seed leaves unseen, by turns; None for fewer than two folds."""
    folds = np.unique(fold_N[fold_N >= 0])
    return fold_N == folds[seed % len(folds)] if len(folds) >= 2 else None


def drawn(cluster_N: np.ndarray, share: float, *axes: object) -> np.ndarray:
    """Return the rows (N,) of a share of the clusters, drawn with the seed axes: at least one cluster, never all."""
    clusters = np.unique(cluster_N)
    count = min(max(1, round(share * len(clusters))), len(clusters) - 1)
    return np.isin(cluster_N, generator(*axes).permutation(clusters)[:count])
