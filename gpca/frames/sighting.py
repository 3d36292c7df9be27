"""What a depth camera measured of one object, and with which camera: all that a frame tells of it without the truth."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Sighting:
    """An object in a depth frame.

    Attributes:
        points_m: (N, 3) measured points in the camera's frame, all of them or some.
        pixels: (P, 2) every pixel at which it was measured, (u, v).
        camera_3_3: K in pixels.
    """

    points_m: np.ndarray
    pixels: np.ndarray
    camera_3_3: np.ndarray

    def measured(self, pixels_V_2: np.ndarray) -> np.ndarray:
        """Return at which of these pixels (V, 2) the object was measured, (V,) bool."""
        low_2, mask = self._mask
        of_box_V_2 = pixels_V_2 - low_2
        inside_V = ((of_box_V_2 >= 0) & (of_box_V_2 < mask.shape)).all(axis=1)
        measured_V = np.zeros(len(pixels_V_2), bool)
        measured_V[inside_V] = mask[tuple(of_box_V_2[inside_V].T)]
        return measured_V

    @cached_property
    def _mask(self) -> tuple[np.ndarray, np.ndarray]:
        """The first pixel of a box around all of them, and which pixels of that box they are."""
        low_2 = self.pixels.min(axis=0)
        mask = np.zeros(self.pixels.max(axis=0) - low_2 + 1, bool)
        mask[tuple((self.pixels - low_2).T)] = True
        return low_2, mask
