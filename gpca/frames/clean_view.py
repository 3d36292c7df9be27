"""The view of a perfect sensor: an instance's mesh, rendered at the true pose with nothing in front."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.rigid import inverse, rotate, transform
from gpca.frames.camera import MeshScene
from gpca.frames.instances import Instances

MOST_PIXELS = 20_000  # of a rendered side, about; of more, every second or third row and column is looked at


@dataclass(frozen=True)
class CleanView:
    """An instance in the frame of its object, meters.

    Attributes:
        measured: (P, 3) points that the sensor measured.
        clean: (P, 3) where the rays of the same pixels meet the mesh; where one misses it, the nearest rendered point.
        unmeasured: (V, 3) the other points that the camera would see, had nothing been in front and no pixel failed.
        share: of the whole visible side that was measured.
    """

    measured: np.ndarray
    clean: np.ndarray
    unmeasured: np.ndarray
    share: float


def clean_view(instances: Instances, i: int, mesh: MeshScene, surface_m: np.ndarray) -> CleanView | None:
    """Return instance i beside what a perfect sensor would have seen; None where no ray of its pixels meets the mesh.

    Args:
        mesh: of its object alone, in the object's frame.
        surface_m: (Q, 3) points on it, which tell where in the image it lies.
    """
    T_camera_object, camera_3_3 = instances.T_camera_object_true[i], instances.camera_3_3[i]
    points_m, pixels = instances.cloud_m(i).astype(np.float64), instances.pixels_of(i)
    met_m = met(mesh, points_m / points_m[:, 2:], T_camera_object)
    hit_P = np.isfinite(met_m).all(axis=1)
    side_m, at_V_2, low_2, shape = _rendered(mesh, camera_3_3, T_camera_object, surface_m)
    if not hit_P.any() or not len(side_m):
        return None
    measured_m = transform(inverse(T_camera_object), points_m)
    if not hit_P.all():
        met_m[~hit_P] = met_m[hit_P][cKDTree(met_m[hit_P]).query(measured_m[~hit_P])[1]]
    seen = np.zeros(shape, bool)
    of_box = pixels - low_2
    inside = ((of_box >= 0) & (of_box < shape)).all(axis=1)
    seen[tuple(of_box[inside].T)] = True
    seen_V = seen[tuple((at_V_2 - low_2).T)]
    return CleanView(measured_m, met_m, side_m[~seen_V], float(seen_V.mean()))


def rendered_side(
    mesh: MeshScene, camera_3_3: np.ndarray, T_camera_object: np.ndarray, surface_m: np.ndarray
) -> np.ndarray:
    """Return the points of an object that a camera would see at a pose, (V, 3) in its frame, meters; nothing in front.

    None of it is seen where a part of the object would lie behind the camera.
    """
    return _rendered(mesh, camera_3_3, T_camera_object, surface_m)[0]


def met(mesh: MeshScene, rays_N_3: np.ndarray, T_camera_object: np.ndarray) -> np.ndarray:
    """Return where rays of a camera, whose z is 1, meet an object, (N, 3) in its own frame; NaN where they miss it."""
    T_object_camera = inverse(T_camera_object)
    depth_N = mesh.along(rays_N_3, T_object_camera).depth_m
    return transform(T_object_camera, rays_N_3 * np.where(np.isfinite(depth_N), depth_N, np.nan)[:, None])


def _rendered(
    mesh: MeshScene, camera_3_3: np.ndarray, T_camera_object: np.ndarray, surface_m: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[int, int]]:
    """Return the rendered points (V, 3), their pixels (V, 2), and the first pixel and the size of the box of these."""
    shown = rotate(camera_3_3, transform(T_camera_object, surface_m))
    if shown[:, 2].min() <= 0:
        return np.empty((0, 3)), np.empty((0, 2), int), np.zeros(2, int), (0, 0)
    at_2 = shown[:, :2] / shown[:, 2:]
    low_2, high_2 = np.floor(at_2.min(axis=0)).astype(int), np.ceil(at_2.max(axis=0)).astype(int)
    shape = tuple((high_2 - low_2 + 1).tolist())
    step = max(1, round(np.sqrt(np.prod(shape) / MOST_PIXELS)))
    u, v = (np.arange(low, high + 1, step) for low, high in zip(low_2, high_2, strict=True))
    pixels = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    rays_N_3 = rotate(np.linalg.inv(camera_3_3), np.column_stack([pixels, np.ones(len(pixels))]))
    side_m = met(mesh, rays_N_3, T_camera_object)
    hit_N = np.isfinite(side_m).all(axis=1)
    return side_m[hit_N], pixels[hit_N], low_2, shape
