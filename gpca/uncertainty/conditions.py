"""The names of the conditions that each design runs, for readers of its outcomes; nothing here is slow to load."""

from __future__ import annotations

from typing import NamedTuple

from gpca.pairs.perturbation import CONCEPTS


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
