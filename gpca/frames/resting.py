"""How an object rests on a table: the poses that it does not topple from, and how often it ends in each."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from gpca.alignment.rigid import rigid_motion
from gpca.errors import InputError
from gpca.objects.canonical import diameter
from gpca.objects.surface import Surface

FLAT = 1e-9  # volume of the convex hull in diameters cubed; that of a sheet of paper is 1e-4


def stable_poses(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Return the poses (n, 4, 4) in which an object rests on the plane z = 0, and their probabilities (n,).

    Its density is uniform. Of an open surface the center of mass may come out anywhere; outside of the convex hull,
    where no object has one, the center of the hull takes its place.

    Raises:
        InputError: a surface that has no volume.
    """
    import trimesh

    mesh = trimesh.Trimesh(surface.vertices_m, surface.faces, process=False)
    with np.errstate(invalid="ignore", divide="ignore"):  # what is flat or open may enclose no volume
        hull, center_m = mesh.convex_hull, mesh.center_mass
    if hull.volume < FLAT * diameter(surface.vertices_m, surface.name) ** 3:
        raise InputError(f"object '{surface.name}'", "is flat and cannot be stood on a table", "leave it out")
    if not _is_inside(center_m, hull):
        center_m = hull.center_mass
    return trimesh.poses.compute_stable_poses(mesh, center_mass=center_m, sigma=0.0, threshold=0.0)


def rest(poses_n: np.ndarray, probabilities_n: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Draw one of the stable poses and turn it about the vertical."""
    chosen = poses_n[random.choice(len(poses_n), p=probabilities_n / probabilities_n.sum())]
    return rigid_motion(Rotation.from_euler("z", random.uniform(0, 2 * np.pi)).as_matrix()) @ chosen


def _is_inside(point_m: np.ndarray, hull) -> bool:
    """Return whether a point is inside of a convex mesh, by the test that trimesh repeats until it is passed."""
    from trimesh.util import diagonal_dot

    return bool(np.all(diagonal_dot(point_m - hull.triangles_center, hull.face_normals) < 0))
