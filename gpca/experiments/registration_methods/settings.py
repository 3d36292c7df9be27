"""Settings of the pairs that are registered, apart from the code that runs it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from gpca.alignment.features import NEIGHBORS
from gpca.settings import Bounds

Points = Annotated[int, Bounds(minimum=64, maximum=65536)]


@dataclass(frozen=True)
class PairSettings:
    """The pairs that every method registers.

    Attributes:
        samples: test samples of each source and seed, balanced, at most.
        points: of source and of target (fewer where a cloud has fewer).
        global_start: the global method at whose pose local methods start a second time.
        points_of: method -> its own number of points, where its authors use more than others do.
    """

    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)]
    points: Points
    global_start: str
    points_of: dict[str, Points] = field(default_factory=dict)

    def points_for(self, method: str) -> int:
        """Return how many points of either cloud a method gets."""
        return self.points_of.get(method, self.points)

    def neighbors_among(self, points: int) -> int:
        """Return of how many neighbors normals are estimated: with more points, on as much of the surface."""
        return round(NEIGHBORS * max(1.0, points / self.points))
