"""What depth cameras measure of one object: sightings in frames, clean views, a robot's shots, the next viewpoint."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from gpca.objects.camera import Camera, MeshScene, back_project, direction, look_at, table
from gpca.process.environment import open3d_cloud
from gpca.rigid import inverse, rotate, transform


@dataclass(frozen=True)
class Sighting:
    """Measurements of an object in a depth frame, without the truth."""

    points_m: np.ndarray  # (N, 3) in the camera's frame, all or some
    pixels: np.ndarray  # (P, 2) all at which the object was measured, (u, v)
    camera_3_3: np.ndarray

    def measured(self, pixels_V_2: np.ndarray) -> np.ndarray:
        """Return at which of these pixels (V, 2) the object was measured, (V,) bool."""
        low_2 = self.pixels.min(axis=0)
        mask = np.zeros(self.pixels.max(axis=0) - low_2 + 1, bool)  # within the bounding box
        mask[tuple((self.pixels - low_2).T)] = True
        of_box_V_2 = pixels_V_2 - low_2
        inside_V = ((of_box_V_2 >= 0) & (of_box_V_2 < mask.shape)).all(axis=1)
        measured_V = np.zeros(len(pixels_V_2), bool)
        measured_V[inside_V] = mask[tuple(of_box_V_2[inside_V].T)]
        return measured_V


MOST_PIXELS = 20_000  # of a rendered side, about; of more, every second or third row and column is looked at


@dataclass(frozen=True)
class CleanView:
    """Measurements of an object and a perfect sensor's view of it at some pose, in the object's frame, meters."""

    measured: np.ndarray  # (N, 3) points that the sensor measured
    clean: np.ndarray  # (N, 3) where their rays meet the mesh; where one misses it, the nearest rendered point
    unmeasured: np.ndarray  # (V, 3) points that the camera would see with nothing in front and no failed pixel
    share: float  # of the whole visible side that was measured


def clean_view(
    sighting: Sighting, T_camera_object: np.ndarray, mesh: MeshScene, surface_m: np.ndarray
) -> CleanView | None:
    """Return a sighting beside a perfect view, found by points (Q, 3) on the mesh; None where no ray meets it."""
    points_m = sighting.points_m
    met_m = met(mesh, points_m / points_m[:, 2:], T_camera_object)
    hit_N = np.isfinite(met_m).all(axis=1)
    side_m, pixels = rendered_side(mesh, sighting.camera_3_3, T_camera_object, surface_m)
    if not hit_N.any() or not len(side_m):
        return None
    measured_m = transform(inverse(T_camera_object), points_m)
    if not hit_N.all():
        met_m[~hit_N] = met_m[hit_N][cKDTree(met_m[hit_N]).query(measured_m[~hit_N])[1]]
    seen_V = sighting.measured(pixels)
    return CleanView(measured_m, met_m, side_m[~seen_V], float(seen_V.mean()))


def rendered_side(
    mesh: MeshScene,
    camera_3_3: np.ndarray,
    T_camera_object: np.ndarray,
    surface_m: np.ndarray,
    most_pixels: int = MOST_PIXELS,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the points (V, 3) of an object that a camera would see with nothing in front, and their pixels (V, 2)."""
    shown = rotate(camera_3_3, transform(T_camera_object, surface_m))
    if shown[:, 2].min() <= 0:
        return np.empty((0, 3)), np.empty((0, 2), int)
    at_2 = shown[:, :2] / shown[:, 2:]
    low_2, high_2 = np.floor(at_2.min(axis=0)).astype(int), np.ceil(at_2.max(axis=0)).astype(int)
    step = max(1, round(np.sqrt(np.prod((high_2 - low_2 + 1).astype(float)) / most_pixels)))
    u, v = (np.arange(low, high + 1, step) for low, high in zip(low_2, high_2, strict=True))
    pixels = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    rays_N_3 = rotate(np.linalg.inv(camera_3_3), np.column_stack([pixels, np.ones(len(pixels))]))
    side_m = met(mesh, rays_N_3, T_camera_object)
    hit_N = np.isfinite(side_m).all(axis=1)
    return side_m[hit_N], pixels[hit_N]


def met(mesh: MeshScene, rays_N_3: np.ndarray, T_camera_object: np.ndarray) -> np.ndarray:
    """Return where rays of a camera, with z = 1, meet an object, (N, 3) in its frame; NaN where they miss it."""
    T_object_camera = inverse(T_camera_object)
    depth_N = mesh.along(rays_N_3, T_object_camera).depth_m
    return transform(T_object_camera, rays_N_3 * np.where(np.isfinite(depth_N), depth_N, np.nan)[:, None])


NEIGHBORS, OUTLIER_RATIO = 20, 2.0  # Open3D's usual values for the removal of statistical outliers
NEAR = 0.05  # diameters; a measured point that is so near lies on the model


@dataclass(frozen=True)
class Shot:
    """A robot's measurement of an object from one viewpoint."""

    camera: Camera
    T_world_camera: np.ndarray  # known to the robot
    depth_m: np.ndarray  # (H, W), 0 where nothing was measured; of several frames their median
    mask: np.ndarray  # (H, W) the visible part of the object, by segmentation

    def object_points_m(self, diameter_m: float) -> np.ndarray:
        """Return the object's points (P, 3) in the world, none farther than a diameter from their median."""
        points_m, _ = back_project(self.depth_m, self.mask, self.camera.matrix_3_3)
        if len(points_m):
            points_m = points_m[np.linalg.norm(points_m - np.median(points_m, axis=0), axis=1) <= diameter_m]
        return transform(self.T_world_camera, points_m)

    def other_points_m(self) -> np.ndarray:
        """Return the measured points (P, 3) that are not the object's, in the world."""
        return transform(self.T_world_camera, back_project(self.depth_m, ~self.mask, self.camera.matrix_3_3)[0])

    def project(self, points_m: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the pixels, v and u, and the depth (m) of points (P, 3) in the world; outside the image, (-1, -1)."""
        seen = transform(inverse(self.T_world_camera), points_m)
        pixels = rotate(self.camera.matrix_3_3, seen)
        u, v = np.rint(pixels[:, :2] / np.maximum(pixels[:, 2:], 1e-6)).astype(int).T
        inside = (seen[:, 2] > 0) & (u >= 0) & (u < self.camera.width) & (v >= 0) & (v < self.camera.height)
        return np.where(inside, v, -1), np.where(inside, u, -1), seen[:, 2]


def median_depth(depth_n_H_W: np.ndarray) -> np.ndarray:
    """Return the median depth (H, W) over frames; 0 where fewer than half of them measured anything."""
    measured = (depth_n_H_W > 0).sum(axis=0)
    # What was not measured sorts last, so the middle of what was is at half its number.
    ordered_n_H_W = np.sort(np.where(depth_n_H_W > 0, depth_n_H_W, np.inf), axis=0)
    middles = np.maximum((measured - 1) // 2, 0), np.minimum(measured // 2, len(depth_n_H_W) - 1)
    low, high = (np.take_along_axis(ordered_n_H_W, middle[None], axis=0)[0] for middle in middles)
    known = (measured > 0) & (2 * measured >= len(depth_n_H_W))
    return np.where(known, low, 0.0) / 2 + np.where(known, high, 0.0) / 2


def fuse(shots: Sequence[Shot], diameter_m: float, filtered: bool) -> np.ndarray:
    """Return the object's points (P, 3) of all shots, in the world; `filtered` without outliers (Rusu et al. 2008)."""
    points_m = np.concatenate([shot.object_points_m(diameter_m) for shot in shots])
    if filtered and len(points_m) > NEIGHBORS:
        _, rows = open3d_cloud(points_m).remove_statistical_outlier(NEIGHBORS, OUTLIER_RATIO)
        return points_m[np.asarray(rows)]
    return points_m


def agreement(
    shots: Sequence[Shot],
    points_m: np.ndarray,
    model_m: np.ndarray,
    normals: np.ndarray,
    T_world_object: np.ndarray,
    diameter_m: float,
) -> tuple[float, float, float]:
    """Return the shares of measured points (P, 3) on the model (Q, 3), of its visible surface that was measured where
    it should be, and of its surface facing the camera that is behind something measured."""
    placed_m, facing_out = transform(T_world_object, model_m), rotate(T_world_object, normals)
    reach_m = NEAR * diameter_m
    on_model = np.mean(cKDTree(placed_m).query(points_m, distance_upper_bound=reach_m)[0] < reach_m)
    explained = visible = hidden = 0
    for shot in shots:
        v, u, depth_m = shot.project(placed_m)
        facing = np.sum(facing_out * (placed_m - shot.T_world_camera[:3, 3]), axis=1) < 0
        measured_m, mine = shot.depth_m[v, u], shot.mask[v, u]
        compared = facing & (v >= 0) & (measured_m > 0)
        seen = compared & (mine | (measured_m > depth_m - reach_m))
        visible += seen.sum()
        hidden += (compared & ~seen).sum()
        explained += (seen & mine & (np.abs(measured_m - depth_m) < reach_m)).sum()
    return float(on_model), float(explained / max(1, visible)), float(hidden / max(1, visible + hidden))


VOXEL_M = 0.012  # whatever else was measured becomes boxes of this size, which hide what is behind them
ON_TABLE_M = 0.008  # what lies lower is the table
_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
_SIDES = ([0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3])  # around each
_FACES = np.array([triangle for a, b, c, d in _SIDES for triangle in ([a, b, c], [a, c, d])])


def candidates(center_m: np.ndarray, distance_m: float, azimuths: int, elevations_deg: Sequence[float]) -> np.ndarray:
    """Return camera poses ``T_world_camera`` (n, 4, 4) on a hemisphere about a point, which they look at."""
    angles = product(np.deg2rad(elevations_deg), 2 * np.pi * np.arange(azimuths) / azimuths)
    ways = (direction(azimuth, elevation) for elevation, azimuth in angles)
    return np.array([look_at(center_m + distance_m * way, center_m) for way in ways])


def occupy(points_m: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return boxes around measured points above the table as one mesh, or None where there are none."""
    cells = np.unique(np.floor(points_m[points_m[:, 2] > ON_TABLE_M] / VOXEL_M).astype(int), axis=0)
    if not len(cells):
        return None
    vertices_m = VOXEL_M * (cells[:, None] + _CORNERS).reshape(-1, 3)
    return vertices_m, (len(_CORNERS) * np.arange(len(cells))[:, None, None] + _FACES).reshape(-1, 3)


def expected_surface(
    shots: Sequence[Shot],
    vertices_m: np.ndarray,
    faces: np.ndarray,
    points_m: np.ndarray,
    T_world_object: np.ndarray,
    diameter_m: float,
    poses_n: np.ndarray,
    camera: Camera,
) -> tuple[np.ndarray, np.ndarray]:
    """Return which points (Q, 3) of the model were measured (Q,), and which each viewpoint would show (n, Q)."""
    placed_m = transform(T_world_object, points_m)
    reach_m = NEAR * diameter_m
    measured_m = np.concatenate([shot.object_points_m(diameter_m) for shot in shots])
    seen_Q = np.zeros(len(placed_m), bool)
    if len(measured_m):
        seen_Q = cKDTree(measured_m).query(placed_m, distance_upper_bound=reach_m)[0] < reach_m
    around = occupy(np.concatenate([shot.other_points_m() for shot in shots]))
    scene = MeshScene([(transform(T_world_object, vertices_m), faces), table(), *([around] if around else [])])
    shown_n_Q = []
    for T_world_camera in poses_n:
        view = scene.look(camera, T_world_camera)
        v, u, depth_m = Shot(camera, T_world_camera, view.depth_m, view.mesh == 0).project(placed_m)
        shown_n_Q.append((v >= 0) & (view.mesh[v, u] == 0) & (np.abs(view.depth_m[v, u] - depth_m) < reach_m))
    return seen_Q, np.array(shown_n_Q)


def best_viewpoint(seen_Q: np.ndarray, shown_n_Q: np.ndarray) -> int:
    """Return the viewpoint after which most of the surface was seen; of equals, the one that shows most by itself."""
    return int(np.lexsort((-shown_n_Q.sum(axis=1), -(seen_Q | shown_n_Q).sum(axis=1)))[0])
