"""A small vocabulary of solids: primitives, sweeps, booleans, all watertight, z up.

Lengths are meters wherever a shape leaves this package. The functions themselves carry no unit, so a shape may be
drawn in millimeters and brought to meters once, at its end (`moved(mesh, scale=0.001)` or `scaled_to`).
Booleans go straight to manifold3d in float64; trimesh's own wrapper rounds every operand to float32.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh
from manifold3d import CrossSection, Manifold, Mesh64, OpType
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.spatial.distance import pdist
from trimesh.smoothing import filter_laplacian
from trimesh.transformations import euler_matrix

SEGMENTS = 64
BALL_SEGMENTS = 24  # few suffice for roundings, which are small beside their body
AXES = {"x": (0, 90, 0), "y": (-90, 0, 0), "z": (0, 0, 0)}  # rotation that takes z to the axis, degrees

Point = ArrayLike  # three numbers, in a section two
Points = ArrayLike  # (K, 3), in a section (K, 2)


def box(extents: Point, at: Point = (0, 0, 0), rounding: float = 0) -> trimesh.Trimesh:
    """Return a box of full side lengths `extents` centered at `at`; `rounding` is the radius of edges and corners."""
    inner = np.asarray(extents, float) - 2 * rounding
    if not rounding:
        return _trimesh(Manifold.cube(inner, center=True).translate(at))
    ball = Manifold.sphere(rounding, BALL_SEGMENTS)
    corners = [ball.translate(inner * (np.array(corner) - 0.5)) for corner in np.ndindex(2, 2, 2)]
    return _trimesh(Manifold.batch_hull(corners).translate(at))


def cylinder(radius: float, height: float, at: Point = (0, 0, 0), axis: str = "z", top: float | None = None):
    """Return a cylinder centered at `at` along x, y or z; `top` is the upper radius of a cone frustum."""
    body = Manifold.cylinder(height, radius, radius if top is None else top, SEGMENTS, center=True)
    return _trimesh(body.rotate(AXES[axis]).translate(at))


def ellipsoid(radii: float | Point, at: Point = (0, 0, 0)) -> trimesh.Trimesh:
    """Return an ellipsoid of semi-axes `radii` (one number: a ball) centered at `at`."""
    return _trimesh(Manifold.sphere(1, SEGMENTS).scale(np.broadcast_to(radii, 3)).translate(at))


def revolve(profile_rz: Points) -> trimesh.Trimesh:
    """Return the solid of revolution about z of a closed profile (r ≥ 0, z), which touches the axis or makes a ring."""
    return _trimesh(Manifold.revolve(_section(profile_rz), SEGMENTS))


def extrude(polygon_xy: Points, height: float, rounding: float = 0, rounding_z: float = 0) -> trimesh.Trimesh:
    """Return a prism over a polygon, z from 0 to `height`.

    `rounding` rounds the polygon's corners (the upright edges); `rounding_z` rounds the rims of top and bottom, and all
    corners with them. The polygon must be wider than twice the rounding everywhere.
    """
    section = _section(polygon_xy)
    if rounding:  # inwards, then outwards beyond, then back: outer and inner corners alike
        section = section.offset(-rounding).offset(2 * rounding, circular_segments=SEGMENTS)
        section = section.offset(-rounding, circular_segments=SEGMENTS)
    if not rounding_z:
        return _trimesh(Manifold.extrude(section, height))
    core = Manifold.extrude(section.offset(-rounding_z).simplify(rounding_z / 50), height - 2 * rounding_z)
    ball = Manifold.sphere(rounding_z, BALL_SEGMENTS)
    return _trimesh(core.minkowski_sum(ball).translate((0, 0, rounding_z)))


def tube(
    path: Points,
    radii: ArrayLike,
    side: Point = (0, 1, 0),
    aspect: float = 1,
    smooth: bool = True,
    steps: int = 48,
    segments: int = 32,
) -> trimesh.Trimesh:
    """Sweep a circle along a path, flat at both ends: for handles, spouts, tails, bananas.

    Args:
        path: (K, 3) points; a cubic spline runs through them when `smooth`, else straight lines.
        radii: one radius, or one for each point of the path (> 0).
        side: direction across the path along which the circle is stretched by `aspect`.
        aspect: 1 for a round tube, above for a strap.
        smooth: whether to interpolate the path.
        steps: rings along a smooth path.
        segments: corners of the circle.
    """
    path_K_3 = np.asarray(path, float)
    radii_K = np.broadcast_to(np.asarray(radii, float), len(path_K_3))
    if smooth and len(path_K_3) > 2:
        arc = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path_K_3, axis=0), axis=1))])
        along = np.linspace(0, arc[-1], steps)
        radii_K = PchipInterpolator(arc, radii_K)(along)
        path_K_3 = CubicSpline(arc, path_K_3)(along)
    steps_unit = np.diff(path_K_3, axis=0)
    steps_unit /= np.linalg.norm(steps_unit, axis=1, keepdims=True)
    tangents = np.concatenate([steps_unit[:1], steps_unit[:-1] + steps_unit[1:], steps_unit[-1:]])
    angles = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    across = np.asarray(side, float)
    rings = []
    for center, radius, tangent in zip(path_K_3, radii_K, tangents, strict=True):
        tangent = tangent / np.linalg.norm(tangent)
        across = across - (across @ tangent) * tangent  # carried along the path, so that the circle never twists
        across /= np.linalg.norm(across)
        circle = np.outer(aspect * np.cos(angles), across) + np.outer(np.sin(angles), np.cross(tangent, across))
        rings.append(center + radius * circle)
    return _skin(rings)


def loft(rings: Sequence[Points]) -> trimesh.Trimesh:
    """Return a skin over rings of equally many points, counterclockwise seen from the last; the ends are flat."""
    return _skin([np.asarray(ring, float) for ring in rings])


def hull(*meshes: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return the convex hull of all meshes together: for tapered blocks and rounded slabs."""
    return _trimesh(Manifold.hull_points(np.vstack([mesh.vertices for mesh in meshes])))


def union(*meshes: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return the union of all meshes."""
    return _trimesh(Manifold.batch_boolean([_manifold(mesh) for mesh in meshes], OpType.Add))


def difference(mesh: trimesh.Trimesh, *cut: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return `mesh` without the others."""
    return _trimesh(Manifold.batch_boolean([_manifold(each) for each in (mesh, *cut)], OpType.Subtract))


def intersection(*meshes: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return the part that all of the meshes share."""
    return _trimesh(Manifold.batch_boolean([_manifold(mesh) for mesh in meshes], OpType.Intersect))


def blend(*meshes: trimesh.Trimesh, edge: float, rounds: int = 10) -> trimesh.Trimesh:
    """Return the union, its seams smoothed away as in modeling clay.

    Edges are cut to at most `edge` and smoothed by Laplacian rounds that keep the volume; what is then flat within
    1/30 of `edge` is merged into larger triangles.
    """
    joined = _trimesh(_manifold(union(*meshes)).refine_to_length(edge))
    return _trimesh(_manifold(filter_laplacian(joined, iterations=rounds)).simplify(edge / 30))


def move(mesh: trimesh.Trimesh, translation: Point = (0, 0, 0), rotation_xyz_deg: Point = (0, 0, 0), scale: float = 1):
    """Return a copy of the mesh, scaled, then turned about the fixed axes x, y, z through the origin, then shifted."""
    x, y, z = np.radians(rotation_xyz_deg)
    transform = euler_matrix(x, y, z, axes="sxyz")
    transform[:3, :3] *= scale
    transform[:3, 3] = translation
    return mesh.copy().apply_transform(transform)


def scale_to(mesh: trimesh.Trimesh, extents: Point | None = None, diameter: float | None = None) -> trimesh.Trimesh:
    """Return a copy scaled about the origin, per axis to `extents`, then evenly to `diameter` (at least one)."""
    scaled = mesh.copy()
    if extents is not None:
        scaled.apply_scale(np.asarray(extents, float) / mesh.extents)
    if diameter is not None:
        scaled.apply_scale(diameter / pdist(scaled.convex_hull.vertices).max())
    return scaled


def _section(polygon: Points) -> CrossSection:
    corners_K_2 = np.asarray(polygon, float)
    x, y = corners_K_2.T
    clockwise = x @ np.roll(y, -1) < y @ np.roll(x, -1)
    return CrossSection([corners_K_2[::-1] if clockwise else corners_K_2])


def _skin(rings: list[np.ndarray]) -> trimesh.Trimesh:
    count, size = len(rings), len(rings[0])
    corner = np.arange(count * size).reshape(count, size)
    low, high, after = corner[:-1], corner[1:], np.roll(corner, -1, axis=1)
    sides = [np.stack([low, after[:-1], after[1:]], -1), np.stack([low, after[1:], high], -1)]
    first, last = count * size, count * size + 1
    caps = [
        np.stack([after[0], corner[0], np.full(size, first)], -1),
        np.stack([corner[-1], after[-1], np.full(size, last)], -1),
    ]
    vertices = np.vstack([*rings, rings[0].mean(0), rings[-1].mean(0)])
    faces = np.vstack([part.reshape(-1, 3) for part in sides + caps])
    return _trimesh(_manifold(trimesh.Trimesh(vertices, faces, process=False)))


def _manifold(mesh: trimesh.Trimesh) -> Manifold:
    return Manifold(Mesh64(np.array(mesh.vertices, np.float64), np.array(mesh.faces, np.uint64)))


def _trimesh(manifold: Manifold) -> trimesh.Trimesh:
    if manifold.is_empty():  # manifold3d reports a faulty operand this way, and only this way
        raise ValueError("nothing is left of this solid, or one of its parts is not a closed surface")
    mesh = manifold.to_mesh64()
    return trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts.astype(np.int64), process=False)
