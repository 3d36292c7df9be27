"""Mugs and cups: one table of dimensions, one way of building them, every one hollow and open at the top."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import trimesh
from scipy.interpolate import PchipInterpolator

from gpca.objects.shapes.solids import difference, move, revolve, tube, union

# Handles as curves from the upper to the lower joint: (share of the reach, share of the way up from the lower joint).
HANDLES: dict[str, Sequence[tuple[float, float]]] = {
    "C": ((0, 1), (0.55, 1.0), (0.92, 0.78), (1, 0.5), (0.92, 0.22), (0.55, 0.0), (0, 0)),
    "D": ((0, 1), (0.45, 1), (0.8, 0.98), (0.97, 0.85), (1, 0.5), (0.97, 0.15), (0.8, 0.02), (0.45, 0), (0, 0)),
    "ear": ((0, 1), (0.4, 1.1), (0.85, 1.02), (1, 0.75), (0.8, 0.4), (0.4, 0.12), (0, 0)),
}


@dataclass(frozen=True)
class Cup:
    """Dimensions of one cup in millimeters.

    Attributes:
        profile: (outer radius, height) from the foot (height 0) to the rim; a smooth monotone curve runs through them.
        wall: thickness of the wall.
        floor: thickness of the floor.
        fillet: radius of the edge between foot and wall.
        handle: a key of HANDLES, or None for a cup without.
        joints: heights of the lower and the upper joint of the handle.
        reach: how far the handle's middle line stands out.
        grip: half the handle's thickness.
        strap: the handle's width over its thickness.
        handles: how many, evenly around.
        rim: radius of a rolled rim; 0 for a plain lip.
    """

    profile: tuple[tuple[float, float], ...]
    wall: float = 4
    floor: float = 5
    fillet: float = 5
    handle: str | None = "C"
    joints: tuple[float, float] = (20, 75)
    reach: float = 30
    grip: float = 4.5
    strap: float = 1.5
    handles: int = 1
    rim: float = 0


CUPS = {
    "classic_mug": Cup(((41, 0), (41, 96))),
    "diner_mug": Cup(((38, 0), (39, 25), (36.5, 50), (38, 75), (41, 88)), 7, 8, 8, "ear", (22, 66), 29, 6, 1.3),
    "tapered_mug": Cup(((29, 0), (36, 50), (45, 102)), 3.5, 5, 4, "ear", (28, 82), 32, 4, 1.8),
    "barrel_mug": Cup(((34, 0), (43, 30), (45, 50), (43, 70), (37, 98)), 5, 6, 6, "C", (22, 76), 32, 5.5),
    "bowl_mug": Cup(((24, 0), (42, 20), (51, 45), (54, 78)), 4, 5, 6, "C", (26, 66), 28, 5),
    "espresso_cup": Cup(((22, 0), (28, 26), (30, 62)), 4, 5, 6, "C", (18, 49), 18, 3.2),
    "tea_cup": Cup(((22, 0), (25, 4), (38, 28), (44, 50), (49, 72)), 2.8, 4, 2, "ear", (24, 56), 26, 3, 1.2),
    "latte_mug": Cup(((30, 0), (31, 40), (35, 90), (42, 122)), 4, 8, 5, "D", (24, 82), 32, 5, 1.2),
    "camping_mug": Cup(((42, 0), (42, 80)), 1.8, 1.8, 5, "D", (16, 66), 27, 2, 6, rim=2.4),
    "stacking_cup": Cup(
        ((33, 0), (33, 24), (34, 27), (40.5, 31), (41, 34), (41, 75)), 3.5, 4, 3, "D", (38, 66), 24, 4, 2
    ),
    "soup_mug": Cup(((40, 0), (57, 25), (61, 50), (60, 72)), 5, 6, 10, "ear", (32, 60), 24, 5, 2, handles=2),
    "beer_stein": Cup(((46, 0), (43, 12), (41, 60), (39, 120)), 6, 10, 4, "D", (18, 104), 40, 7, 1.2),
    "paper_cup": Cup(((29, 0), (44, 110)), 1.6, 4, 1, None, rim=2.5),
    "tumbler": Cup(((27, 0), (33, 15), (36, 50), (37, 88)), 4, 6, 6, None),
}


def build(cup: Cup) -> trimesh.Trimesh:
    """Build the mesh of one cup in meters, with its foot at z = 0 and its first handle toward +x."""
    radii, heights = np.array(cup.profile).T
    outline = PchipInterpolator(heights, radii)
    top = heights[-1]
    lip = 0.45 * cup.wall
    z = _heights(0, cup.fillet, top, lip)
    outer = outline(z) - _inset(z, cup.fillet) - _inset(top - z, lip)
    body = revolve([(0, 0), *zip(outer, z, strict=True), (0, top)])

    inner_fillet = max(cup.fillet, cup.wall)
    z = _heights(cup.floor, inner_fillet, top, lip)
    inner = outline(z) - cup.wall - _inset(z - cup.floor, inner_fillet) + _inset(top - z, lip)
    cavity = revolve([(0, cup.floor), *zip(inner, z, strict=True), (inner[-1], top + 1), (0, top + 1)])

    parts = [body]
    if cup.rim:
        angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        middle = radii[-1] - lip + cup.rim / 2
        parts.append(revolve(np.stack([middle + cup.rim * np.cos(angles), top - lip + cup.rim * np.sin(angles)], -1)))
    if cup.handle:
        handle = _handle(cup, HANDLES[cup.handle], outline)
        parts += [move(handle, rotation_xyz_deg=(0, 0, 360 * turn / cup.handles)) for turn in range(cup.handles)]
    # Handles reach into the wall, so that the cavity is cut last and trims what would stand out inside.
    recess = revolve([(0, -1), (0.8 * outer[0], -1), (0.76 * outer[0], 0.3 * cup.floor), (0, 0.3 * cup.floor)])
    return move(difference(union(*parts), cavity, recess), scale=0.001)


def _heights(bottom: float, fillet: float, top: float, lip: float) -> np.ndarray:
    """Return heights from bottom to top, dense where the fillet and the rounded lip are steep."""
    rise = 1 - np.cos(np.linspace(0, np.pi / 2, 8))
    straight = np.linspace(bottom + fillet, top - lip, 32)[1:-1]
    return np.concatenate([bottom + fillet * rise, straight, (top - lip * rise)[::-1]])


def _inset(distance: np.ndarray, radius: float) -> np.ndarray:
    """Return how far a fillet of this radius draws the wall in at a distance from the end."""
    beyond = np.clip(radius - distance, 0, radius)
    return radius - np.sqrt(radius**2 - beyond**2)


def _handle(cup: Cup, shape: Sequence[tuple[float, float]], outline: PchipInterpolator) -> trimesh.Trimesh:
    out, up = np.array(shape).T
    low, high = cup.joints
    wall_x = outline(low) + up * (outline(high) - outline(low))
    path = np.stack([wall_x + out * cup.reach, np.zeros_like(up), low + up * (high - low)], axis=-1)
    path[[0, -1], 0] -= 0.6 * cup.wall + 1.5
    return tube(path, cup.grip, aspect=cup.strap)


OBJECTS: dict[str, Callable[[], trimesh.Trimesh]] = {name: partial(build, cup) for name, cup in CUPS.items()}
