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
        neighbors_of: method -> of how many neighbors its normals are, where these are not the usual ones.
    """

    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)]
    points: Points
    global_start: str
    points_of: dict[str, Points] = field(default_factory=dict)
    neighbors_of: dict[str, Annotated[int, Bounds(minimum=3, maximum=1000)]] = field(default_factory=dict)

    def points_for(self, method: str) -> int:
        """Return how many points of either cloud a method gets."""
        return self.points_of.get(method, self.points)

    def neighbors_for(self, method: str) -> int:
        """Return of how many neighbors a method's normals are estimated."""
        return self.neighbors_of.get(method, NEIGHBORS)
