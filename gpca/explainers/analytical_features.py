"""Analytical features of how well source and target agree; the paper names them, and the formulas are ours."""

import numpy as np

from gpca.pairs.dataset import Registrations
from gpca.seeds import generator


def analytical_features(
    registrations: Registrations, *axes: object, shape_points: int = 256, neighbors: int = 16
) -> np.ndarray:
    """Return (N, F): inlier RMSE (of diameters), the features of :func:`compare`, and the point-count ratio."""
    rows = []
    for i in range(len(registrations)):
        source, target = registrations.cloud(i), registrations.target(i)
        random = generator(*axes, registrations.split[i], registrations.sample[i])
        drawn = random.permutation(len(source))[:shape_points]
        measured = compare(source, target, drawn, neighbors)
        rows.append([registrations.inlier_rmse[i], *measured, len(source) / len(target)])
    return np.array(rows)


def compare(source_P_3: np.ndarray, target_Q_3: np.ndarray, drawn: np.ndarray, neighbors: int) -> list[float]:
    """Compare normals, planarity, linearity of the source at the drawn points with the nearest target points."""
    from scipy.spatial import cKDTree

    source_tree, target_tree = cKDTree(source_P_3), cKDTree(target_Q_3)
    query_D_3 = source_tree.data[drawn]
    _, nearest_D = target_tree.query(query_D_3)
    normals_D_3, *shape = local_shape(source_tree, query_D_3, neighbors)
    target_normals_D_3, *target_shape = local_shape(target_tree, target_tree.data[nearest_D], neighbors)
    agreement = np.abs(np.sum(normals_D_3 * target_normals_D_3, axis=1)).mean()
    differences = [(source_D - target_D).mean() for source_D, target_D in zip(shape, target_shape, strict=True)]
    return [agreement, *(source_D.mean() for source_D in shape), *differences]


def local_shape(tree, query_D_3: np.ndarray, neighbors: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return normals (D, 3), planarity (λ2 - λ3)/λ1 and linearity (λ1 - λ2)/λ1 of neighbors (Weinmann et al. 2015)."""
    _, rows_D_K = tree.query(query_D_3, k=min(neighbors, tree.n))
    points_D_K_3 = tree.data[rows_D_K]
    offsets_D_K_3 = points_D_K_3 - points_D_K_3.mean(axis=1, keepdims=True)
    eigenvalues_D_3, eigenvectors_D_3_3 = np.linalg.eigh(offsets_D_K_3.transpose(0, 2, 1) @ offsets_D_K_3)
    smallest_D, middle_D, largest_D = eigenvalues_D_3.T
    scale_D = np.where(largest_D > 0, largest_D, 1.0)
    return eigenvectors_D_3_3[:, :, 0], (middle_D - smallest_D) / scale_D, (largest_D - middle_D) / scale_D
