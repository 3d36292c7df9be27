"""Settings of Monte-Carlo ICP and the conditions of each design; nothing here needs compiled loops."""

from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.pairs.perturbation import CONCEPTS
from gpca.settings import Bounds

MONTE_CARLO = "monte_carlo"  # the estimator that these are settings of
FEWEST_STARTS = 13  # the 2·6 + 1 of an unscented estimate; a 6×6 covariance of 6 samples or fewer is singular


def start_deviation(rotation_deg: float, translation: float) -> np.ndarray:
    """Return the standard deviations (6,) of a start's twist per axis, from those of its rotation and translation."""
    return np.repeat(np.array([np.deg2rad(rotation_deg), translation]) / np.sqrt(3), 3)


@dataclass(frozen=True)
class UncertaintySettings:
    """Settings of how the spread is measured."""

    starts: Annotated[int, Bounds(minimum=FEWEST_STARTS)] = 50  # n, initial poses per condition
    # Root mean square angle and length of the starts' offsets.
    start_rotation_deg: Annotated[float, Bounds(exclusiveMinimum=0, maximum=180)] = 10.0
    start_translation: Annotated[float, Bounds(exclusiveMinimum=0, maximum=10)] = 0.05
    icp_points: Annotated[int, Bounds(minimum=16, maximum=65536)] = 512  # of each cloud in these runs, at most
    # ε, variance below which a spread is no uncertainty: (1e-3)² is 0.06° and a thousandth of the diameter.
    floor: Annotated[float, Bounds(exclusiveMinimum=0, maximum=1)] = 1e-6
    icp: ICPSettings = field(default_factory=ICPSettings)

    def deviation_6(self) -> np.ndarray:
        """Return the standard deviations (σ_rot ×3, σ_t ×3) of a start's twist, in radians and diameters."""
        return start_deviation(self.start_rotation_deg, self.start_translation)


class Remedies(NamedTuple):
    """The switches of the remedies, in the order of the concepts noise, pose, overlap."""

    denoise: bool = False
    restart: bool = False
    trim: bool = False


LATIN = 24  # settings of the knobs in a Latin hypercube
SALTELLI = 8  # base samples of Saltelli's scheme, which makes five settings of each
# The corners of the cube of three switches; corner b has switch i on where bit i of b is set.
CORNERS = tuple(tuple(bool(corner >> i & 1) for i in range(3)) for corner in range(8))


def _corners(switches: tuple[str, ...], none: str) -> tuple[str, ...]:
    """Return a name for each corner: the switches that are on, `none` where all are off."""
    return tuple("+".join(name for name, on in zip(switches, corner, strict=True) if on) or none for corner in CORNERS)


CONDITIONS = {
    "additive": (*_corners(CONCEPTS, "untouched"), *(f"{concept}_step" for concept in CONCEPTS)),
    "latin": ("untouched", *(f"latin_{k}" for k in range(LATIN))),
    "saltelli": ("untouched", *(f"saltelli_{k}" for k in range(5 * SALTELLI))),
    "oracle": _corners(CONCEPTS, "untouched"),
    "removal": _corners(Remedies._fields, "observed"),
    "observed": ("observed",),
    "causal": ("reference", "clean", "observed"),
}
