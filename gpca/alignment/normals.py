"""Normals of a cloud that has none: the direction in which a point's neighbors spread least."""

from __future__ import annotations

import numpy as np

from gpca.process.environment import open3d_cloud, require_open3d

NEIGHBORS = 20  # as Open3D takes for the covariances of generalized ICP


def estimate_normals(points_N_3: np.ndarray, neighbours: int = NEIGHBORS) -> np.ndarray:
    """Return unit normals (N, 3) that point away from the center of the cloud.

    The neighbors leave the sign open. Away from the center is outward on a convex object, and elsewhere at least the
    same side in two clouds of one object.
    """
    cloud = open3d_cloud(points_N_3)
    cloud.estimate_normals(require_open3d().geometry.KDTreeSearchParamKNN(neighbours))
    normals_N_3 = np.array(cloud.normals)
    outward_N_3 = points_N_3 - points_N_3.mean(axis=0)
    inward_N = np.einsum("ni,ni->n", normals_N_3, outward_N_3) < 0
    return np.where(inward_N[:, None], -normals_N_3, normals_N_3)
