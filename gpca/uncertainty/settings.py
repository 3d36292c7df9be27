"""Settings of Monte-Carlo ICP, kept apart from the code that runs it: nothing here needs compiled loops."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.settings import Bounds

MONTE_CARLO = "monte_carlo"  # the estimator that these are settings of
FEWEST_STARTS = 13  # the 2·6 + 1 of an unscented estimate; a 6×6 covariance of 6 samples or fewer is singular


def start_deviation(rotation_deg: float, translation: float) -> np.ndarray:
    """Return the standard deviations (6,) of a start's twist per axis, from those of its rotation and translation."""
    return np.repeat(np.array([np.deg2rad(rotation_deg), translation]) / np.sqrt(3), 3)


@dataclass(frozen=True)
class UncertaintySettings:
    """Settings of how the spread is measured.

    Attributes:
        starts: n, initial poses per condition.
        start_rotation_deg, start_translation: root mean square angle and length of the starts' offsets.
        icp_points: of source and of target in these runs (fewer where a cloud has fewer).
        floor: ε, variance below which a spread is no uncertainty: (1e-3)² is 0.06° and a thousandth of the diameter.
        icp: how ICP runs.
    """

    starts: Annotated[int, Bounds(minimum=FEWEST_STARTS)] = 50
    start_rotation_deg: Annotated[float, Bounds(exclusiveMinimum=0, maximum=180)] = 10.0
    start_translation: Annotated[float, Bounds(exclusiveMinimum=0, maximum=10)] = 0.05
    icp_points: Annotated[int, Bounds(minimum=16, maximum=65536)] = 512
    floor: Annotated[float, Bounds(exclusiveMinimum=0, maximum=1)] = 1e-6
    icp: ICPSettings = field(default_factory=ICPSettings)

    def deviation_6(self) -> np.ndarray:
        """Standard deviations (σ_rot ×3, σ_t ×3) of a start's twist, in radians and diameters."""
        return start_deviation(self.start_rotation_deg, self.start_translation)
