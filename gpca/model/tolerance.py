"""How far a pose may be off: a length, a rotation, or a share of the target's diameter."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import pi, radians, sin

import numpy as np

from gpca.errors import InputError
from gpca.model.result import DEFAULT_TOLERANCE
from gpca.numerals import decimal
from gpca.objects.surface import METERS_PER_UNIT

SHARE, ANGLE = "%", "deg"
LARGEST = 0.5  # of the target's diameter; beyond, no pose would be wrong
REMEDY = f"give a length, an angle or a share of the diameter, such as 5mm, 2{ANGLE} or 3{SHARE}"


@dataclass(frozen=True)
class Tolerance:
    """A value with `SHARE`, `ANGLE` or a unit of length."""

    value: float
    unit: str

    @classmethod
    def parse(cls, text: str) -> Tolerance:
        """Read a text such as ``5mm``, ``2deg`` or ``3%``; an InputError for any other."""
        units = "|".join((SHARE, ANGLE, *METERS_PER_UNIT))
        match = re.fullmatch(rf"(.+?) ?({units})", text.strip())
        try:
            tolerance = cls(decimal(match[1]), match[2]) if match else None
        except ValueError:
            tolerance = None
        if tolerance is None or not 0 < tolerance.value < np.inf:
            raise InputError(f"tolerance '{text}'", "is not positive, or has no unit", REMEDY)
        return tolerance

    def length(self, target: np.ndarray, diameter: float, unit: str) -> float:
        """Return the distance it allows a point of a target (M, 3) in diameters; of an angle, the mean by a turn."""
        if self.unit == SHARE:
            length = self.value / 100 * diameter
        elif self.unit == ANGLE:
            # A point at the distance d from the center is on average π/4 · d from an axis through the center.
            arm = pi / 4 * float(np.linalg.norm(target, axis=1).mean()) * diameter
            length = 2 * sin(radians(min(self.value, 180.0)) / 2) * arm
        else:
            length = self.value * METERS_PER_UNIT[self.unit] / METERS_PER_UNIT[unit]
        if not length <= LARGEST * diameter:
            fault = f"is {length / diameter:.3g} diameters of the target"
            raise InputError(f"tolerance {self}", fault, f"give at most half of the diameter, {diameter:.4g} {unit}")
        return length

    def __str__(self) -> str:
        return f"{self.value:g}{self.unit}" if self.unit == SHARE else f"{self.value:g} {self.unit}"


DEFAULT = Tolerance(100 * DEFAULT_TOLERANCE, SHARE)
