"""The view of a perfect sensor: an object's mesh, rendered at a pose with nothing in front."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.rigid import inverse, rotate, transform
from gpca.frames.camera import MeshScene
from gpca.frames.sighting import Sighting

MOST_PIXELS = 20_000  # of a rendered side, about; of more, every second or third row and column is looked at


@dataclass(frozen=True)
class CleanView:
    """What was measured of an object, beside a perfect sensor's view of it at some pose; in the object's frame, meters.

    Attributes:
        measured: (N, 3) points that the sensor measured.
        clean: (N, 3) where the rays of the same pixels meet the mesh; where one misses it, the nearest rendered point.
        unmeasured: (V, 3) the other points that the camera would see, had nothing been in front and no pixel failed.
        share: of the whole visible side that was measured.
    """

    measured: np.ndarray
    clean: np.ndarray
    unmeasured: np.ndarray
    share: float


@dataclass(frozen=True)
class Side:
    """The side that an object turns to a camera.

    Attributes:
        points_m: (V, 3) in the object's frame, one for each pixel.
        pixels: (V, 2) where the camera sees them, (u, v); also beside the image.
    """

    points_m: np.ndarray
    pixels: np.ndarray

    def __len__(self) -> int:
        return len(self.points_m)


def clean_view(
    sighting: Sighting, T_camera_object: np.ndarray, mesh: MeshScene, surface_m: np.ndarray
) -> CleanView | None:
    """Return what was seen of an object beside what a perfect sensor would have seen, were this its pose.

    None where no ray of its pixels meets the mesh.

    Args:
        mesh: of the object alone, in the object's frame.
        surface_m: (Q, 3) points on it, which tell where in the image it lies.
    """
    points_m = sighting.points_m
    met_m = met(mesh, points_m / points_m[:, 2:], T_camera_object)
    hit_N = np.isfinite(met_m).all(axis=1)
    side = rendered_side(mesh, sighting.camera_3_3, T_camera_object, surface_m)
    if not hit_N.any() or not len(side):
        return None
    measured_m = transform(inverse(T_camera_object), points_m)
    if not hit_N.all():
        met_m[~hit_N] = met_m[hit_N][cKDTree(met_m[hit_N]).query(measured_m[~hit_N])[1]]
    seen_V = sighting.measured(side.pixels)
    return CleanView(measured_m, met_m, side.points_m[~seen_V], float(seen_V.mean()))


def rendered_side(
    mesh: MeshScene,
    camera_3_3: np.ndarray,
    T_camera_object: np.ndarray,
    surface_m: np.ndarray,
    most_pixels: int = MOST_PIXELS,
) -> Side:
    """Return the side of an object that a camera would see at a pose with nothing in front.

    None of it is seen where a part of the object would lie behind the camera.

    Args:
        most_pixels: that are looked at, about.
    """
    shown = rotate(camera_3_3, transform(T_camera_object, surface_m))
    if shown[:, 2].min() <= 0:
        return Side(np.empty((0, 3)), np.empty((0, 2), int))
    at_2 = shown[:, :2] / shown[:, 2:]
    low_2, high_2 = np.floor(at_2.min(axis=0)).astype(int), np.ceil(at_2.max(axis=0)).astype(int)
    step = max(1, round(np.sqrt(np.prod((high_2 - low_2 + 1).astype(float)) / most_pixels)))
    u, v = (np.arange(low, high + 1, step) for low, high in zip(low_2, high_2, strict=True))
    pixels = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    rays_N_3 = rotate(np.linalg.inv(camera_3_3), np.column_stack([pixels, np.ones(len(pixels))]))
    side_m = met(mesh, rays_N_3, T_camera_object)
    hit_N = np.isfinite(side_m).all(axis=1)
    return Side(side_m[hit_N], pixels[hit_N])


def met(mesh: MeshScene, rays_N_3: np.ndarray, T_camera_object: np.ndarray) -> np.ndarray:
    """Return where rays of a camera, whose z is 1, meet an object, (N, 3) in its own frame; NaN where they miss it."""
    T_object_camera = inverse(T_camera_object)
    depth_N = mesh.along(rays_N_3, T_object_camera).depth_m
    return transform(T_object_camera, rays_N_3 * np.where(np.isfinite(depth_N), depth_N, np.nan)[:, None])
