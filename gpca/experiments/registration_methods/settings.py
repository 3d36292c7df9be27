"""Settings of the pairs that are registered, and of what counts as a success, apart from the code that runs it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from gpca.settings import Bounds, PositiveShare


@dataclass(frozen=True)
class PairSettings:
    """The pairs that every method registers.

    Attributes:
        samples: test samples of each source and seed, balanced, at most.
        points: of source and of target (fewer where a cloud has fewer).
        success: largest error of a success, ADD or ADD-S in diameters.
        global_start: the global method at whose pose local methods start a second time.
    """

    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)]
    points: Annotated[int, Bounds(minimum=64, maximum=65536)]
    success: PositiveShare
    global_start: str
