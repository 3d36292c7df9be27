"""Clouds and poses as the page's script reads them: coordinates as 16-bit steps in base64, all in one frame."""

from __future__ import annotations

from base64 import b64decode, b64encode
from pathlib import Path

import numpy as np

from gpca.alignment.rigid import transform
from gpca.causes.shapley import BY_SIZE
from gpca.model.scene import Possibility, Scene

ASSETS = Path(__file__).with_name("assets")  # style and script of the view
MOST_POINTS = 3000  # of each cloud; more hide one another
LARGEST_STEP = 2**15 - 1
FARTHEST = 4.0  # diameters from the target's center: what lies beyond is not in view


def packed_scene(scene: Scene, unit: str) -> dict[str, object]:
    """Return a scene as plain JSON values; see :func:`packed_pair`."""
    pair = packed_pair(scene.target, scene.source, scene.T_found, scene.reach, scene.frame.diameter, unit)
    return pair | {"poses": [_pose(possibility) for possibility in scene.possibilities]}


def packed_pair(
    target: np.ndarray, source: np.ndarray, T_found: np.ndarray, reach: float, diameter: float, unit: str
) -> dict[str, object]:
    """Return the two clouds of a registration as plain JSON values, without poses.

    Lengths are in diameters of the target, but for ``diameter``, which is in the unit of the reader.

    Args:
        target: (M, 3). source: (N, 3) where the registration began.
        T_found: 4×4, takes the source from there to where it ended.
        reach: distance from which on all look alike.
    """
    return {
        "unit": unit,
        "diameter": diameter,
        "reach": reach,
        "radius": _radius(target, source, transform(T_found, source)),
        "target": packed(target),
        "source": packed(source),
        "found": flat(T_found),
    }


def _pose(possibility: Possibility) -> dict[str, object]:
    what_ifs = [possibility.what_ifs[subset] for subset in BY_SIZE] if possibility.what_ifs else []
    return {"T": flat(possibility.T), "what_ifs": [packed(what_if.points) for what_if in what_ifs]}


def packed(points: np.ndarray) -> dict[str, object]:
    """Return points (N, 3), or an evenly thinned part of them, as a step and whole numbers of steps."""
    rows = np.linspace(0, len(points) - 1, min(len(points), MOST_POINTS)).astype(int)
    kept = points[rows]
    step = max(float(np.abs(kept).max()), 1e-9) / LARGEST_STEP
    return {"step": step, "data": b64encode(np.rint(kept / step).astype("<i2").tobytes()).decode("ascii")}


def unpacked(cloud: dict) -> np.ndarray:
    """Return the points (N, 3) of a cloud that was :func:`packed`, as the page's script does."""
    return np.frombuffer(b64decode(cloud["data"]), "<i2").reshape(-1, 3) * cloud["step"]


def flat(T: np.ndarray) -> list[float]:
    """Return a matrix row by row."""
    return [float(f"{value:.7g}") for value in T.ravel()]


def _radius(*clouds: np.ndarray) -> float:
    """Return the distance from the target's center within which the clouds lie, but for a few far points."""
    return float(np.clip(max(map(_reach, clouds)), 0.5, FARTHEST))


def _reach(points: np.ndarray) -> float:
    return float(np.quantile(np.linalg.norm(points, axis=1), 0.98))


def distances(points: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the distance (N,) of each point (N, 3) to the nearest one of the target (M, 3)."""
    from scipy.spatial import cKDTree

    return cKDTree(target).query(points)[0]
