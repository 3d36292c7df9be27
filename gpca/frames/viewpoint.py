"""The next viewpoint: where more of the object's surface should come into sight, judged by what is known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.rigid import transform
from gpca.frames.camera import Camera, MeshScene, look_at
from gpca.frames.rgbd_scene import table
from gpca.frames.shots import NEAR, Shot

VOXEL_M = 0.012  # whatever else was measured becomes boxes of this size, which hide what is behind them
ON_TABLE_M = 0.008  # what lies lower is the table
_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
_SIDES = ([0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3])  # around each
_FACES = np.array([triangle for a, b, c, d in _SIDES for triangle in ([a, b, c], [a, c, d])])


def candidates(center_m: np.ndarray, distance_m: float, azimuths: int, elevations_deg: Sequence[float]) -> np.ndarray:
    """Return camera poses ``T_world_camera`` (n, 4, 4) on a hemisphere about a point, which they look at."""
    poses = []
    for elevation in np.deg2rad(elevations_deg):
        for azimuth in 2 * np.pi * np.arange(azimuths) / azimuths:
            flat = np.cos(elevation) * np.array([np.cos(azimuth), np.sin(azimuth)])
            poses.append(look_at(center_m + distance_m * np.array([*flat, np.sin(elevation)]), center_m))
    return np.array(poses)


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
    """Return which of the model's points were measured (Q,), and which each viewpoint would show (n, Q).

    The model is ray-cast at the estimated pose, among boxes where something else was measured and over the table. What
    nobody has seen yet counts as free.

    Args:
        vertices_m, faces: the model, in its own frame.
        points_m: (Q, 3) on its surface.
        T_world_object: the estimate.
        camera: what the candidates look with; few pixels suffice.
    """
    placed_m = transform(T_world_object, points_m)
    reach_m = NEAR * diameter_m
    measured_m = np.concatenate([shot.object_points_m(diameter_m) for shot in shots])
    seen_Q = np.zeros(len(placed_m), bool)
    if len(measured_m):
        seen_Q = cKDTree(measured_m).query(placed_m, distance_upper_bound=reach_m)[0] < reach_m
    around = occupy(np.concatenate([shot.other_points_m() for shot in shots]))
    meshes = [(transform(T_world_object, vertices_m), faces), table(), *([around] if around else [])]
    scene = MeshScene(meshes)
    shown_n_Q = []
    for T_world_camera in poses_n:
        view = scene.look(camera, T_world_camera)
        v, u, depth_m = Shot(camera, T_world_camera, view.depth_m, view.mesh == 0).project(placed_m)
        shown_n_Q.append((v >= 0) & (view.mesh[v, u] == 0) & (np.abs(view.depth_m[v, u] - depth_m) < reach_m))
    return seen_Q, np.array(shown_n_Q)


def best_viewpoint(seen_Q: np.ndarray, shown_n_Q: np.ndarray) -> int:
    """Return the viewpoint after which most of the surface was seen; of equals, the one that shows most by itself."""
    together_n = (seen_Q | shown_n_Q).sum(axis=1)
    alone_n = shown_n_Q.sum(axis=1)
    return int(np.lexsort((-alone_n, -together_n))[0])
