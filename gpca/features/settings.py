"""The groups of features and some of their columns by name, and the settings that bound the work of measuring them.

Nothing here needs the code that computes them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from gpca.settings import Bounds, Positive
from gpca.uncertainty.settings import start_deviation

GROUPS = ("distances", "planes", "motion", "starts", "remedied", "entropy")
QUANTILES = 13  # of each distance
MOTION = (
    *("rotation", "translation", "displacement", "fitness", "inlier_rmse"),
    *("spread_rotation", "spread_translation", "log_determinant"),
)
# Of the groups distances and motion, joined: every other quantile of the three distances, and all of the motion.
RESIDUALS = (*range(0, 3 * QUANTILES, 2), *range(4 * QUANTILES, 4 * QUANTILES + len(MOTION)))
DENSITIES = tuple(range(3 * QUANTILES, 3 * QUANTILES + 6))  # of the planes: spacings, extents, numbers of points
DescribedPoints = Annotated[int, Bounds(minimum=16, maximum=65536)]  # of each cloud


@dataclass(frozen=True)
class DescriptorSettings:
    """The registrations that a description runs again with remedies.

    Attributes:
        starts: near the initial pose, and as many as that again farther off where the remedy is a restart.
        start_rotation_deg, start_translation: root mean square angle and length (diameters) of the offsets near by.
        restarts: starts farther off.
        restart_rotation_deg, restart_translation: theirs.
        icp_points: of each cloud in these runs, at most.
    """

    starts: Annotated[int, Bounds(minimum=1, maximum=1000)] = 3
    start_rotation_deg: Annotated[float, Bounds(exclusiveMinimum=0, maximum=180)] = 10.0
    start_translation: Positive = 0.05
    restarts: Annotated[int, Bounds(minimum=1, maximum=1000)] = 8
    restart_rotation_deg: Annotated[float, Bounds(exclusiveMinimum=0, maximum=180)] = 50.0
    restart_translation: Positive = 0.25
    icp_points: Annotated[int, Bounds(minimum=16, maximum=65536)] = 512

    def twists(self, near_k_6: np.ndarray, far_k_6: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the twists of the starts near by and farther off, of standard normal numbers (k, 6)."""
        return (
            near_k_6 * start_deviation(self.start_rotation_deg, self.start_translation),
            far_k_6 * start_deviation(self.restart_rotation_deg, self.restart_translation),
        )
