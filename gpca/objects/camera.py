"""A virtual RGB-D camera: ray casting, shading, noise of a structured-light sensor."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from gpca.process.environment import require_open3d
from gpca.rigid import dots, rigid_motion, rotate
from gpca.settings import Bounds, Positive

Pixels = Annotated[int, Bounds(minimum=16, maximum=4096)]

NOTHING = -1  # the mesh of a pixel that sees none
TABLE_M = 1.2  # edge length of the table that scenes stand on


@dataclass(frozen=True)
class Camera:
    """A pinhole camera with whole coordinates at pixel centers, looking along +z, x right and y down."""

    width: Pixels = 640
    height: Pixels = 480
    focal_px: Positive = 570.0

    @property
    def matrix_3_3(self) -> np.ndarray:
        """K, with the principal point in the middle of the image."""
        center_u, center_v = (self.width - 1) / 2, (self.height - 1) / 2
        return np.array([[self.focal_px, 0, center_u], [0, self.focal_px, center_v], [0, 0, 1.0]])

    def rays(self) -> np.ndarray:
        """Return the direction (H, W, 3) of every pixel whose z is 1, so that a ray's length is its depth."""
        v, u = np.mgrid[: self.height, : self.width]
        return rotate(np.linalg.inv(self.matrix_3_3), np.stack([u, v, np.ones_like(u)], axis=-1))


@dataclass(frozen=True)
class View:
    """The view of a camera without noise."""

    depth_m: np.ndarray  # (H, W), infinite where there is nothing
    mesh: np.ndarray  # (H, W) number of the mesh seen, `NOTHING` where there is none
    cosine: np.ndarray  # (H, W) of the angle between the surface's normal and the direction to the camera, in [0, 1]
    normals: np.ndarray  # (H, W, 3) unit normals in the camera's frame, turned to the camera


class MeshScene:
    """Meshes, each vertices (V, 3) in meters and faces (F, 3), in one world frame, ready to be rendered."""

    def __init__(self, meshes: Sequence[tuple[np.ndarray, np.ndarray]]) -> None:
        o3d = require_open3d()
        self._tensor = o3d.core.Tensor
        self._scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        corners_F_3_3 = np.concatenate([np.asarray(vertices_m, float)[faces] for vertices_m, faces in meshes])
        self._first_face = np.cumsum([0, *(len(faces) for _, faces in meshes)])
        self._normal_F_3, self._offset_F_m = planes(corners_F_3_3)
        for mesh in meshes:
            arrays = (np.ascontiguousarray(of, kind) for of, kind in zip(mesh, (np.float32, np.uint32), strict=True))
            self._scene.add_triangles(*map(self._tensor, arrays))

    def silhouette(self, camera: Camera, T_world_camera: np.ndarray) -> np.ndarray:
        """Return the pixels (H, W) that see something, as booleans."""
        return np.isfinite(self._cast(camera.rays(), T_world_camera)["t_hit"].numpy())

    def look(self, camera: Camera, T_world_camera: np.ndarray) -> View:
        """Return the view of the camera from a pose."""
        return self.along(camera.rays(), T_world_camera)

    def along(self, rays_H_W_3: np.ndarray, T_world_camera: np.ndarray) -> View:
        """Return the view along rays (..., 3) of a camera, whose z has to be 1."""
        hits = self._cast(rays_H_W_3, T_world_camera)
        hit = np.isfinite(hits["t_hit"].numpy())
        mesh = np.where(hit, hits["geometry_ids"].numpy().astype(np.int64), NOTHING)
        face = np.where(hit, self._first_face[mesh] + hits["primitive_ids"].numpy(), 0)
        normals = self._normal_F_3[face] * hit[..., None]
        # Where the ray meets the face's plane: Embree divides by the processor's own approximate reciprocal.
        height_m = self._offset_F_m[face] - dots(normals, T_world_camera[:3, 3])
        depth_m = np.full(hit.shape, np.inf)
        np.divide(height_m, dots(normals, rotate(T_world_camera, rays_H_W_3)), out=depth_m, where=hit)
        normals = rotate(T_world_camera[:3, :3].T, normals)
        to_camera = -rays_H_W_3 / np.linalg.norm(rays_H_W_3, axis=-1, keepdims=True)
        cosine = dots(normals, to_camera)
        normals *= np.where(cosine < 0, -1, 1)[..., None]
        return View(depth_m, mesh, np.abs(cosine), normals)

    def _cast(self, rays_H_W_3: np.ndarray, T_world_camera: np.ndarray):
        directions = rotate(T_world_camera, rays_H_W_3)
        origins = np.broadcast_to(T_world_camera[:3, 3], directions.shape)
        rays = np.concatenate([origins, directions], axis=-1).astype(np.float32)
        return self._scene.cast_rays(self._tensor(rays), nthreads=1)


def planes(corners_F_3_3: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the unit normals (F, 3) of triangles (F, corner, 3), 0 where one has no area, and normal · corner (F,)."""
    a, b, c = np.moveaxis(corners_F_3_3, 1, 0)
    across = np.cross(b - a, c - a)
    lengths = np.linalg.norm(across, axis=1, keepdims=True)
    normal_F_3 = np.divide(across, lengths, out=np.zeros_like(across), where=lengths > 0)
    return normal_F_3, dots(normal_F_3, a)


@dataclass(frozen=True)
class DepthNoise:
    """Noise of a structured-light camera (Nguyen et al., 3DIMPVT 2012); lateral noise shifts pixels, so edges fray."""

    scale: Annotated[float, Bounds(minimum=0, maximum=10)] = 1.0  # factor of both; 0 is a perfect sensor
    grazing_deg: Annotated[float, Bounds(exclusiveMinimum=0, maximum=90)] = 80.0  # steepest that is measured
    dropout: Annotated[float, Bounds(minimum=0, exclusiveMaximum=1)] = 0.01  # share of failed pixels

    def measure(self, view: View, random: np.random.Generator) -> np.ndarray:
        """Return measured depth (H, W) in meters, 0 where nothing was measured."""
        # The angle between surface and line of sight.
        theta = np.minimum(np.arccos(np.clip(view.cosine, 0, 1)), np.deg2rad(89))
        height, width = view.depth_m.shape
        lateral_px = self.scale * (0.8 + 0.035 * theta / (np.pi / 2 - theta))
        v, u = np.mgrid[:height, :width]
        shift = random.normal(size=(2, height, width)) * lateral_px
        v = np.clip(np.rint(v + shift[0]).astype(int), 0, height - 1)
        u = np.clip(np.rint(u + shift[1]).astype(int), 0, width - 1)
        z, theta = view.depth_m[v, u], theta[v, u]
        measured = np.isfinite(z) & (theta < np.deg2rad(self.grazing_deg)) & (random.random(z.shape) >= self.dropout)
        z = np.where(measured, z, 1.0)
        steep = 0.0001 * theta**2 / (np.sqrt(z) * (np.pi / 2 - theta) ** 2)
        axial_m = 0.0012 + 0.0019 * (z - 0.4) ** 2 + np.where(theta > np.deg2rad(60), steep, 0.0)
        return np.where(measured, z + self.scale * axial_m * random.normal(size=z.shape), 0.0)


def shade(view: View, colors_M_3: np.ndarray, T_world_camera: np.ndarray) -> np.ndarray:
    """Return Lambert's image (H, W, 3) uint8 of meshes with colors in [0, 1] under a lamp; gray where nothing is."""
    lamp_world = np.array([0.3, -0.2, 1.0]) / np.linalg.norm([0.3, -0.2, 1.0])
    lamp_camera = T_world_camera[:3, :3].T @ lamp_world
    light = 0.45 + 0.55 * np.clip(view.normals @ lamp_camera, 0, 1)
    colors = np.where((view.mesh == NOTHING)[..., None], 0.55, colors_M_3[view.mesh] * light[..., None])
    return np.rint(255 * np.clip(colors, 0, 1)).astype(np.uint8)


def direction(azimuth: float, elevation: float) -> np.ndarray:
    return np.array([*(np.cos(elevation) * np.array([np.cos(azimuth), np.sin(azimuth)])), np.sin(elevation)])


def look_at(eye_m: np.ndarray, target_m: np.ndarray) -> np.ndarray:
    """Return ``T_world_camera`` of an upright camera at `eye_m` that looks at `target_m` (world z up)."""
    z = (target_m - eye_m) / np.linalg.norm(target_m - eye_m)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return rigid_motion(np.stack([x, np.cross(z, x), z], axis=1), eye_m)


def table() -> tuple[np.ndarray, np.ndarray]:
    """Return the table's top, a square at z = 0, as vertices and faces."""
    corners_4_3 = TABLE_M / 2 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    return corners_4_3, np.array([[0, 1, 2], [0, 2, 3]])


def back_project(depth_m: np.ndarray, mask: np.ndarray, camera_3_3: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a mask's measured points (P, 3) in the camera's frame, meters, and their pixels (P, 2) as (u, v)."""
    v, u = np.nonzero(mask & (depth_m > 0))
    z = depth_m[v, u].astype(np.float64)
    (fx, skew, cx), (_, fy, cy), _ = camera_3_3
    y = (v - cy) / fy
    x = (u - cx - skew * y) / fx
    return np.stack([x * z, y * z, z], axis=1), np.stack([u, v], axis=1)
