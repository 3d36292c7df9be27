"""Settings of the pairs that are registered, apart from the code that runs it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from gpca.settings import Bounds


@dataclass(frozen=True)
class PairSettings:
    """The pairs that every method registers.

    Attributes:
        samples: test samples of each source and seed, balanced, at most.
        points: of source and of target (fewer where a cloud has fewer).
        global_start: the global method at whose pose local methods start a second time.
    """

    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)]
    points: Annotated[int, Bounds(minimum=64, maximum=65536)]
    global_start: str
