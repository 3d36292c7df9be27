"""Normals and fast point feature histograms (FPFH, Rusu et al. 2009) of points, by their neighbors."""

from typing import Any

import numpy as np

from gpca.process.environment import open3d_cloud, require_open3d

NEIGHBORS = 20  # as Open3D takes for the covariances of generalized ICP
RADIUS = 0.25  # diameters: five times the spacing of some 500 points on an object
MOST_NEIGHBORS = 100


def estimate_normals(points_N_3: np.ndarray, neighbors: int = NEIGHBORS) -> np.ndarray:
    """Return unit normals (N, 3) that point away from the center of the cloud: outward on a convex object."""
    cloud = open3d_cloud(points_N_3)
    cloud.estimate_normals(require_open3d().geometry.KDTreeSearchParamKNN(neighbors))
    normals_N_3 = np.array(cloud.normals)
    inward_N = np.einsum("ni,ni->n", normals_N_3, points_N_3 - points_N_3.mean(axis=0)) < 0
    return np.where(inward_N[:, None], -normals_N_3, normals_N_3)


def fpfh_of_pair(pair: Any, radius: float, most_neighbors: int) -> tuple[list[Any], list[Any]]:
    """Return Open3D's clouds of a pair's source and target, and the features of each, ``.data`` (33, N)."""
    o3d = require_open3d()
    clouds = [open3d_cloud(getattr(pair, name), pair.normals(name)) for name in ("source", "target")]
    neighbors = o3d.geometry.KDTreeSearchParamHybrid(radius, most_neighbors)
    return clouds, [o3d.pipelines.registration.compute_fpfh_feature(cloud, neighbors) for cloud in clouds]


def mutual_matches(source_N_d: np.ndarray, target_P_d: np.ndarray, most: int) -> np.ndarray:
    """Return rows (n, 2) of source and target that are each other's nearest in feature space, at most `most`."""
    from scipy.spatial import cKDTree

    distance_N, nearest_N = cKDTree(target_P_d).query(source_N_d)
    _, nearest_P = cKDTree(source_N_d).query(target_P_d)
    mutual_n = np.flatnonzero(nearest_P[nearest_N] == np.arange(len(source_N_d)))
    best_n = np.sort(mutual_n[np.argsort(distance_N[mutual_n], kind="stable")[:most]])
    return np.stack([best_n, nearest_N[best_n]], axis=1)
