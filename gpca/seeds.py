"""Random generators from named axes, so that no draw depends on call order, thread count or sample count."""

import hashlib
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.numerals import whole


def seed_of(*axes: object) -> int:
    """Return a 63-bit seed for the named axes, e.g. ``seed_of("ycb", 3, "registration", 17)``."""
    text = "\x1f".join(str(axis) for axis in axes)
    return int.from_bytes(hashlib.sha256(text.encode(errors="surrogateescape")).digest()[:8], "big") >> 1


def generator(*axes: object) -> np.random.Generator:
    """Return NumPy's PCG64 generator seeded by :func:`seed_of`."""
    return np.random.default_rng(seed_of(*axes))


def seed_of_file(path: str | Path) -> int:
    """Return the seed in the name of a run's file, ``…/seed3.npz``; InputError for another name."""
    name = Path(path).stem
    try:
        if name.startswith("seed"):
            return whole(name.removeprefix("seed"), most=2**32 - 1)
    except ValueError:
        pass
    raise InputError(path, f"is not named …/seed{{number}}{Path(path).suffix}", "rename it")
