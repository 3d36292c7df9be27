"""Arrays that another step made for the registrations, checked before a rival reads them."""

from __future__ import annotations

import numpy as np

from gpca.errors import InputError
from gpca.pairs.dataset import Registrations


def attached(registrations: Registrations, name: str, *shape: int | None) -> np.ndarray:
    """Return the attached array (S, *shape) as float64; None in `shape` stands for any size but 0.

    Raises:
        InputError: the array is missing, empty, of another shape, or holds NaN or infinity.
    """
    if name not in registrations.attached:
        raise InputError(f"array '{name}'", "is not attached to the registrations", "see Registrations.attached")
    array = np.asarray(registrations.attached[name], float)
    expected = (len(registrations), *shape)
    matches = array.ndim == len(expected) and all(
        actual == size or (size is None and actual > 0) for actual, size in zip(array.shape, expected, strict=True)
    )
    if not matches:
        sizes = "×".join("any" if size is None else str(size) for size in expected)
        raise InputError(f"array '{name}'", f"has shape {array.shape}, not {sizes}", "regenerate it")
    if not np.isfinite(array).all():
        raise InputError(f"array '{name}'", "contains NaN or infinity", "regenerate it")
    return array
