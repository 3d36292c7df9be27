"""Shots: a robot's measurements of an object from known viewpoints, and clouds fused from several of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.rigid import inverse, rotate, transform
from gpca.frames.bop import back_project
from gpca.frames.camera import Camera
from gpca.process.environment import open3d_cloud

NEIGHBORS, OUTLIER_RATIO = 20, 2.0  # Open3D's usual values for the removal of statistical outliers
NEAR = 0.05  # diameters; a measured point that is so near lies on the model


@dataclass(frozen=True)
class Shot:
    """One viewpoint.

    Attributes:
        camera: intrinsics.
        T_world_camera: known to the robot.
        depth_m: (H, W), 0 where nothing was measured; of several frames their median.
        mask: (H, W) the visible part of the object, by segmentation.
    """

    camera: Camera
    T_world_camera: np.ndarray
    depth_m: np.ndarray
    mask: np.ndarray

    def object_points_m(self, diameter_m: float) -> np.ndarray:
        """Return the object's measured points (P, 3) in the world; none farther than a diameter from their median."""
        points_m, _ = back_project(self.depth_m, self.mask, self.camera.matrix_3_3)
        if len(points_m):
            points_m = points_m[np.linalg.norm(points_m - np.median(points_m, axis=0), axis=1) <= diameter_m]
        return transform(self.T_world_camera, points_m)

    def other_points_m(self) -> np.ndarray:
        """Return everything else that was measured (P, 3), in the world."""
        points_m, _ = back_project(self.depth_m, ~self.mask, self.camera.matrix_3_3)
        return transform(self.T_world_camera, points_m)

    def project(self, points_m: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return for points (P, 3) in the world their pixels as v and u, and their depth in meters.

        Points outside the image get the pixel (-1, -1).
        """
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
    """Return the object's points (P, 3) of all shots in the world, without statistical outliers where `filtered`."""
    points_m = np.concatenate([shot.object_points_m(diameter_m) for shot in shots])
    return without_outliers(points_m) if filtered and len(points_m) > NEIGHBORS else points_m


def without_outliers(points: np.ndarray) -> np.ndarray:
    """Remove points that are far from their neighbors by the cloud's own measure (Rusu et al. 2008), by Open3D."""
    _, rows = open3d_cloud(points).remove_statistical_outlier(NEIGHBORS, OUTLIER_RATIO)
    return points[np.asarray(rows)]


def agreement(
    shots: Sequence[Shot],
    points_m: np.ndarray,
    model_m: np.ndarray,
    normals: np.ndarray,
    T_world_object: np.ndarray,
    diameter_m: float,
) -> tuple[float, float, float]:
    """Return how well a pose explains the shots, and how much of the model something else hides, as shares in [0, 1].

    The first is that of the measured points on the model. The second is that of the model's visible surface that was
    measured where it should be; visible is what faces the camera and is not behind something else that was measured.
    The first alone is high for many poses of a partial view. The third is that of the surface facing the camera behind
    something else. Needs no truth.

    Args:
        points_m: measured points (P, 3) in the world. model_m, normals: (Q, 3) in the object's frame.
    """
    placed_m = transform(T_world_object, model_m)
    facing_out = rotate(T_world_object, normals)
    reach_m = NEAR * diameter_m
    on_model = np.mean(cKDTree(placed_m).query(points_m, distance_upper_bound=reach_m)[0] < reach_m)
    explained = visible = hidden = 0
    for shot in shots:
        v, u, depth_m = shot.project(placed_m)
        facing = np.sum(facing_out * (placed_m - shot.T_world_camera[:3, 3]), axis=1) < 0
        measured_m = shot.depth_m[v, u]
        mine = shot.mask[v, u]
        compared = facing & (v >= 0) & (measured_m > 0)
        seen = compared & (mine | (measured_m > depth_m - reach_m))
        visible += seen.sum()
        hidden += (compared & ~seen).sum()
        explained += (seen & mine & (np.abs(measured_m - depth_m) < reach_m)).sum()
    return float(on_model), float(explained / max(1, visible)), float(hidden / max(1, visible + hidden))
