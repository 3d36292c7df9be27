"""Where the search for the true pose starts: rotations of every size, spread evenly."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from gpca.alignment.rigid import rigid_motion, rotate

# How many rotations, up to which angle (degrees), and whether about the cloud's own center or that of its frame. Where
# surface is missing, the center of what was observed is not the object's; where the start is off, the frame's is not.
SPREADS = ((48, 109.0, True), (24, 100.0, False), (24, 180.0, True))


def search_starts(observed: np.ndarray, model: np.ndarray) -> np.ndarray:
    """Return poses (n, 4, 4) of the observed points (N, 3) in the frame of the model (M, 3), the identity first."""
    center, model_center = observed.mean(axis=0), model.mean(axis=0)
    poses = [np.eye(4)[None]]
    for count, largest_deg, about_center in SPREADS:
        R_n = rotations(count, largest_deg)
        shift_n = model_center - np.stack([rotate(R, center) for R in R_n]) if about_center else np.zeros((len(R_n), 3))
        poses.append(rigid_motion(R_n, shift_n))
    return np.concatenate(poses)


@cache
def rotations(count: int, largest_deg: float) -> np.ndarray:
    """Return about so many rotations (n, 3, 3) of at most an angle, spread evenly (super-Fibonacci, Alexa 2022)."""
    largest = np.deg2rad(largest_deg)
    share = (largest - np.sin(largest)) / np.pi  # of all rotations
    n = round(count / share)
    i = np.arange(n) + 0.5
    inner, outer = np.sqrt(i / n), np.sqrt(1 - i / n)
    first, second = 2 * np.pi * i / 2**0.5, 2 * np.pi * i / 1.533751168755204288118041
    spread = Rotation.from_quat(
        np.column_stack([inner * np.sin(first), inner * np.cos(first), outer * np.sin(second), outer * np.cos(second)])
    )
    return spread.as_matrix()[spread.magnitude() <= largest]
