"""The canonical frame of a target, in which encoders are trained: centered on its bounding box, in diameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpca.errors import InputError
from gpca.objects.canonical import FEWEST_CLOUD_POINTS, diameter, require_points, require_size
from gpca.objects.mesh_folder import meters_per
from gpca.objects.surface import IN_CONFIG
from gpca.seeds import generator

MEASURED_POINTS = 10_000  # at most, that determine the frame: all points of a cloud may lie on its hull


@dataclass(frozen=True)
class CanonicalFrame:
    """The origin, the center of the axis-aligned bounding box, and the unit, the diameter."""

    center_3: np.ndarray
    diameter: float

    @classmethod
    def of(
        cls, points: np.ndarray, unit: str = "m", subject: object = "target", say: str = IN_CONFIG
    ) -> CanonicalFrame:
        """Measure the points (N, 3) of a target.

        `subject` and `say` are the target and the place of its unit, for messages. InputError for too few points, NaN,
        points on one line, or a diameter that the unit does not give.
        """
        require_cloud_points(points, subject)
        points = thin(points, MEASURED_POINTS, "frame")
        size = diameter(points, subject)
        require_size(size * meters_per(unit), subject, say)
        return cls((points.min(axis=0) + points.max(axis=0)) / 2, size)

    def coordinates(self, points: np.ndarray) -> np.ndarray:
        """Return points (N, 3) in this frame."""
        return (points - self.center_3) / self.diameter

    def pose_outside(self, T_b_a: np.ndarray) -> np.ndarray:
        """Return a motion (4, 4) of this frame in the original frame and unit."""
        outside = T_b_a.copy()
        outside[:3, 3] = self.diameter * T_b_a[:3, 3] + self.center_3 - T_b_a[:3, :3] @ self.center_3
        return outside


def require_cloud_points(points: np.ndarray, subject: object) -> None:
    """Raise an InputError unless the points are (N, 3), finite, and enough for the encoders."""
    require_points(points, subject)
    if len(points) < FEWEST_CLOUD_POINTS:
        raise InputError(subject, f"has {len(points)} points", f"give {FEWEST_CLOUD_POINTS} or more")


def thin(points: np.ndarray, most: int, *axes: object) -> np.ndarray:
    """Return the points (N, 3), or `most` of them drawn at random; the axes name the seed."""
    if len(points) <= most:
        return points
    return points[generator("thinned", *axes).choice(len(points), most, replace=False, shuffle=False)]
