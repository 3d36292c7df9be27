"""Surfaces into canonical clouds: sampled uniformly, centered on the bounding box, measured by diameter, checked."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gpca import seeds
from gpca.errors import InputError
from gpca.io.arrays import REAL, REGENERATE, TEXT, WHOLE, load_arrays, save_arrays
from gpca.io.names import is_name
from gpca.objects.splits import DRAWN, families_and_folds, read_object_splits, without_unused
from gpca.objects.surface import IN_CONFIG, Surface, instance_of
from gpca.process.environment import open3d_cloud, require_open3d

FEWEST_CLOUD_POINTS = 64
SMALLEST_DIAMETER_M, LARGEST_DIAMETER_M = 1e-3, 10.0
NORMAL_NEIGHBORS = 30
# A cloud spans nearly its object's diameter. Few points miss some of it, but never nine tenths.
SMALLEST_EXTENT = 0.1  # diameters
UNIT_TOLERANCE = 1e-3  # of the length of a normal, a hundred times what float32 rounds
NEARLY = 0.1  # steps; other numbers lie up to half a step off
COARSEST = 0.01  # of a cloud's extent may lie between two numbers; the least part of a cause in the error is as much
FEW_POINTS = 600  # up to so many, all distances take less time than the hull


def require_points(points: np.ndarray, subject: object) -> None:
    """Raise InputError unless `points` is (P, 3), P > 0, finite, and not rounded away by a large offset."""
    if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0:
        raise InputError(subject, "has no points", "fetch or export it again")
    bad = int((~np.isfinite(points)).any(axis=1).sum())
    if bad:
        raise InputError(subject, f"{bad} of {len(points)} points contain NaN or infinity", "fetch or export it again")
    _require_resolution(points, subject)


def _require_resolution(points: np.ndarray, subject: object) -> None:
    """Raise an InputError where an offset leaves float32 or float64 too few digits to tell the points apart."""
    extent, largest_3 = np.linalg.norm(np.ptp(points, axis=0)), np.abs(points).max(axis=0)
    for kind in (np.float32, np.float64):
        with np.errstate(all="ignore"):  # float32 does not hold all that float64 does
            step_3 = np.spacing(largest_3.astype(kind)).astype(np.float64)
            coarse_3 = step_3 > COARSEST * extent
            # Files of text do not write all digits.
            off = np.abs(points[:, coarse_3].astype(kind) - points[:, coarse_3]) / step_3[coarse_3]
            rounded = (off < NEARLY).all()
        if extent > 0 and coarse_3.any() and rounded:
            step, largest = step_3.max(), largest_3[coarse_3].max()
            fault = f"at coordinates of {largest:.3g}, {kind.__name__} has steps of {step:.2g}, but all points span "
            remedy = "subtract an offset before saving it, from source and target alike"
            raise InputError(subject, f"{fault}{extent:.2g}", remedy)


def diameter(points: np.ndarray, subject: object) -> float:
    """Return the largest distance between two of the (P, 3) points, in their unit (the diameter of the BOP benchmark).

    The two farthest points are vertices of the convex hull, so only those are compared; of few points, all are.
    InputError for no points, NaN, or points on one line.
    """
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


def canonical_cloud(
    surface: Surface, source: str, n_points: int = 16384, say: str = IN_CONFIG
) -> tuple[np.ndarray, np.ndarray, float]:
    """Sample a surface uniformly and center it on its bounding box.

    A mesh gives `n_points` area-uniform samples with the normals of their triangles. A point cloud keeps all its
    points, in random order; missing normals are estimated and turned toward the camera at the origin.

    Args:
        surface: vertices in meters; its name and that of the `source` seed the sampling.
        say: how the user sets the unit, for messages.

    Returns:
        points_m (P, 3) float32, unit normals (P, 3) float32, diameter in meters of the vertices.

    Raises:
        InputError: no points, NaN, no area, too few points, or a diameter that no declared unit would give.
    """
    subject = f"{source}: object '{surface.name}'"
    vertices_m = np.asarray(surface.vertices_m, dtype=np.float64)
    faces = surface.faces
    require_points(vertices_m, subject)
    if faces is None:
        if len(vertices_m) < FEWEST_CLOUD_POINTS:
            raise InputError(
                subject, f"the cloud has {len(vertices_m)} point(s)", f"give {FEWEST_CLOUD_POINTS} or more"
            )
        hull_m, draw = vertices_m, _shuffled
    else:
        if n_points < FEWEST_CLOUD_POINTS:
            raise InputError(subject, f"{n_points} surface points", f"ask for {FEWEST_CLOUD_POINTS} or more")
        if len(faces) == 0 or not np.linalg.norm(_area_vectors(vertices_m, faces), axis=1).sum() > 0:
            raise InputError(subject, "the mesh has no area", "export it again with its faces")
        hull_m, draw = _used_vertices(surface), _sampled
    diameter_m = diameter(hull_m, subject)
    require_size(diameter_m, subject, say)
    points_m, normals = draw(surface, n_points, seeds.generator(source, surface.name, "surface"))
    return (points_m - bounding_center(surface)).astype(np.float32), normals.astype(np.float32), diameter_m


def bounding_center(surface: Surface) -> np.ndarray:
    """Return the center (3,) of a surface's upright bounding box in meters: the origin of its canonical cloud."""
    used_m = _used_vertices(surface)
    return (used_m.min(axis=0) + used_m.max(axis=0)) / 2


def _used_vertices(surface: Surface) -> np.ndarray:
    vertices_m = np.asarray(surface.vertices_m, dtype=np.float64)
    # Vertices that no face uses are no surface.
    return vertices_m if surface.faces is None else vertices_m[np.unique(surface.faces)]


def require_size(diameter_m: float, subject: object, say: str = IN_CONFIG) -> None:
    """Raise an InputError unless a diameter is 1 mm to 10 m; `say` is how the user sets the unit."""
    if SMALLEST_DIAMETER_M <= diameter_m <= LARGEST_DIAMETER_M:
        return
    unit, short = ("millimeters", "mm") if diameter_m > LARGEST_DIAMETER_M else ("meters", "m")
    fault = f"its diameter is {diameter_m:.4g} m, so the declared unit looks wrong"
    raise InputError(subject, fault, f"is it in {unit}? {say.format(short)}")


def _area_vectors(vertices_m: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = (vertices_m[faces[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)


def _sampled(surface: Surface, n_points: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    import trimesh

    mesh = trimesh.Trimesh(surface.vertices_m, surface.faces, process=False)
    points_m, face = trimesh.sample.sample_surface(mesh, n_points, seed=rng)
    normals = _area_vectors(surface.vertices_m, surface.triangles[face])
    return np.asarray(points_m), normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _shuffled(surface: Surface, n_points: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    order = rng.permutation(len(surface.vertices_m))
    normals = normals_towards_camera(surface.vertices_m) if surface.normals is None else surface.normals
    return surface.vertices_m[order], normals[order]


def normals_towards_camera(points_m: np.ndarray) -> np.ndarray:
    """Return unit normals (P, 3) from nearest neighbors, turned toward a camera at the origin."""
    cloud = open3d_cloud(points_m)
    cloud.estimate_normals(require_open3d().geometry.KDTreeSearchParamKNN(NORMAL_NEIGHBORS))
    cloud.orient_normals_towards_camera_location(np.zeros(3))
    return np.asarray(cloud.normals)


def write_objects(
    surfaces: Iterable[Surface], source: str, path: str | Path, n_points: int = 16384, splits: Path | None = None
) -> None:
    """Write the canonical clouds of a source to an objects npz (read it with :class:`ObjectClouds`).

    Families and folds are those of the file `splits`, if given. InputError for no object, two of one name, or a fault
    in one of them; nothing is written then.
    """
    places = read_object_splits(splits, source) if splits else {}
    objects = sample_objects(without_unused(surfaces, places), source, n_points)
    replace(objects, **families_and_folds(objects.names, places)).save(path, source)


def sample_objects(surfaces: Iterable[Surface], source: str, n_points: int = 16384) -> ObjectClouds:
    """Return the canonical clouds of a source; InputError as in :func:`write_objects`."""
    names, clouds, diameters_m = [], [], []
    for surface in surfaces:
        if not is_name(surface.name):
            raise InputError(
                f"{source}: object {surface.name!r}", "its name is empty or does not fit on one line", "rename it"
            )
        if surface.name in names:
            raise InputError(f"{source}: object '{surface.name}'", "occurs twice", "give each file its own name")
        points_m, normals, diameter_m = canonical_cloud(surface, source, n_points)
        names.append(surface.name)
        clouds.append((points_m, normals))
        diameters_m.append(diameter_m)
    if not names:
        raise InputError(source, "the source has no object", "check its location and files")
    return ObjectClouds(tuple(names), np.array(diameters_m, dtype=np.float64), tuple(clouds))


@dataclass(frozen=True)
class ObjectClouds:
    """The canonical clouds of one source, as :func:`write_objects` wrote them.

    Attributes:
        names: those of the O objects.
        diameters_m: (O,) float64.
        clouds: for each object its points (P, 3) in meters and unit normals (P, 3), both float32.
        families, folds: of each object, where a file of splits says so; else an instance is a family of its own.
    """

    names: tuple[str, ...]
    diameters_m: np.ndarray
    clouds: tuple[tuple[np.ndarray, np.ndarray], ...]
    families: tuple[str, ...] = ()
    folds: tuple[int, ...] = ()

    @classmethod
    def load(cls, path: str | Path, source: str | None = None) -> ObjectClouds:
        """Read an objects npz; InputError when it is missing, unreadable, inconsistent or of another source than this.

        A file that does not say of which source it is may be of any: rules of users' own write such files.
        """
        shapes = {"names": ("O",), "diameters_m": ("O",), "points_m": ("P", 3), "normals": ("P", 3), "offsets": ("E",)}
        shapes |= {"families": ("O",), "folds": ("O",)}
        kinds = dict.fromkeys(shapes, REAL) | {"names": TEXT, "offsets": WHOLE, "families": TEXT, "folds": WHOLE}
        axes = None if source is None else (source, None)
        arrays = load_arrays(path, shapes, kinds, axes, optional=("source", "families", "folds"))
        points_m, offsets, names = arrays["points_m"], arrays["offsets"], arrays["names"].tolist()
        whole = len(offsets) == len(names) + 1 and offsets[0] == 0 and offsets[-1] == len(points_m)
        if not whole or not names or not (np.diff(offsets) > 0).all():
            raise InputError(path, "names, offsets and points do not match", REGENERATE)
        if len(set(names)) < len(names):
            raise InputError(path, "contains two objects with the same name", REGENERATE)
        parts = (np.split(arrays[key], offsets[1:-1]) for key in ("points_m", "normals"))
        alike = {name: tuple(arrays[name].tolist()) for name in ("families", "folds") if name in arrays}
        objects = cls(tuple(names), arrays["diameters_m"], tuple(zip(*parts, strict=True)), **alike)
        for i, name in enumerate(names):
            objects._require_object(i, f"{path}, object '{name}'")
        return objects

    def _require_object(self, i: int, subject: str) -> None:
        points_m, diameter_m = self.points(i), self.diameters_m[i]
        if not SMALLEST_DIAMETER_M <= diameter_m <= LARGEST_DIAMETER_M:
            raise InputError(subject, f"its diameter is {diameter_m:.4g} m", REGENERATE)
        # From the center of its box, no point of an object is farther away than its diameter.
        extent_m = float(np.linalg.norm(np.ptp(points_m, axis=0)))
        if np.abs(points_m).max() > diameter_m or extent_m < SMALLEST_EXTENT * diameter_m:
            fault = f"its points span {extent_m:.4g} m, its diameter is {diameter_m:.4g} m"
            raise InputError(subject, f"{fault}, or they are not centered", REGENERATE)
        lengths = np.linalg.norm(self.normals(i), axis=1)
        if np.abs(lengths - 1).max() > UNIT_TOLERANCE:
            raise InputError(subject, "a normal is not of unit length", REGENERATE)

    def __len__(self) -> int:
        return len(self.names)

    def points(self, i: int) -> np.ndarray:
        """(P, 3) float32, meters, centered on the object's bounding box."""
        return self.clouds[i][0]

    def normals(self, i: int) -> np.ndarray:
        """(P, 3) float32 unit normals."""
        return self.clouds[i][1]

    def family(self, i: int) -> str:
        """Return the family of shapes that an object belongs to."""
        return self.families[i] if self.families else instance_of(self.names[i])

    def fold(self, i: int) -> int:
        """Return the fold that an object is unseen with; `DRAWN` where no file says so."""
        return self.folds[i] if self.folds else DRAWN

    def save(self, path: str | Path, source: str) -> None:
        """Write the objects npz, and say on stderr what is in it."""
        points_m, normals = zip(*self.clouds, strict=True)
        alike = {"families": np.array(self.families), "folds": np.array(self.folds)} if self.families else {}
        save_arrays(
            path,
            {
                "names": np.array(self.names),
                "points_m": np.concatenate(points_m),
                "normals": np.concatenate(normals),
                "offsets": np.cumsum([0, *map(len, points_m)], dtype=np.int64),
                "diameters_m": self.diameters_m,
                **alike,
            },
            (source, None),
        )
        for name, cloud_m, diameter_m in zip(self.names, points_m, self.diameters_m, strict=True):
            print(f"{source}: {name}: {len(cloud_m)} points, {1e3 * diameter_m:.1f} mm", file=sys.stderr)
