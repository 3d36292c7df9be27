"""The groups of features and some of their columns by name, and the settings that bound the work of measuring them.

Nothing here needs the code that computes them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from gpca.causes.shapley import SUBSETS
from gpca.pairs.perturbation import CONCEPTS
from gpca.settings import Bounds, Positive
from gpca.uncertainty.settings import start_deviation

GROUPS = ("distances", "planes", "motion", "starts", "remedied", "entropy")
QUANTILES = 13  # of each distance
MOTION = (
    *("rotation", "translation", "displacement", "fitness", "inlier_rmse"),
    *("spread_rotation", "spread_translation", "log_determinant"),
)
REMEDIED = (
    *(f"error_{subset}" for subset in range(len(SUBSETS))),
    *(f"phi_{concept}" for concept in CONCEPTS),
    *(f"moved_{subset}" for subset in range(len(SUBSETS))),
    *(f"cost_{subset}" for subset in range(len(SUBSETS))),
    *(f"fitness_{subset}" for subset in range(len(SUBSETS))),
    *("outliers", "smoothed"),
)
DENSITIES = list(range(3 * QUANTILES, 3 * QUANTILES + 6))  # of the planes: spacings, extents, numbers of points
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

    @property
    def quick_remedy_calls(self) -> int:
        """The runs of ICP without a restart: with or without denoising, and with the clouds' roles either way."""
        return 4 * self.starts

    @property
    def remedy_calls(self) -> int:
        """All runs of ICP with remedies: with a restart each combination of the others has more starts."""
        return self.quick_remedy_calls + 4 * self.restarts

    def twists(self, near_k_6: np.ndarray, far_k_6: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the twists of the starts near by and farther off, of standard normal numbers (k, 6)."""
        return (
            near_k_6 * start_deviation(self.start_rotation_deg, self.start_translation),
            far_k_6 * start_deviation(self.restart_rotation_deg, self.restart_translation),
        )
