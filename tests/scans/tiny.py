"""Scenes small enough to know all about: a bumpy floor, seen by windows that overlap."""

import numpy as np

from gpca.rigid import inverse, rigid_motion, transform
from gpca.scans.scene import Scan, ScannedScene

STEP_M = 0.02
SENSORS = [  # T_scene_scan of each scan
    rigid_motion(np.eye(3), (0.0, 0.0, 1.0)),
    rigid_motion(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), (0.3, 0.2, 1.5)),
    rigid_motion(np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), (1.0, -0.5, 2.0)),
]


def floor(first_m, last_m):
    """Points of the floor between two x, y from 0 to 0.4, in the scene."""
    x, y = np.meshgrid(np.arange(first_m, last_m - 1e-9, STEP_M), np.arange(0, 0.4, STEP_M), indexing="ij")
    return np.stack([x, y, 0.1 * np.sin(9 * x) * np.cos(7 * y)], axis=-1).reshape(-1, 3)


def scene(kind="room", name="floor", windows=((0.0, 1.0), (0.5, 1.5), (0.8, 1.8))):
    """Scans of windows of a meter each."""
    scans = {
        str(i): Scan(transform(inverse(T), floor(*window)), T)
        for i, (window, T) in enumerate(zip(windows, SENSORS, strict=False))
    }
    return ScannedScene(name, kind, scans)


def pair(kind="room", target="0", source="1"):
    """The scans of two windows."""
    of = scene(kind)
    return of.pair(next(known for known in of.known() if (known.target, known.source) == (target, source)))
