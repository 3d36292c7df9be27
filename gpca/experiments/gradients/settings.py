"""Settings of the gradients: nothing here needs torch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from gpca.settings import Bounds, Distinct, OpenShare


@dataclass(frozen=True)
class GradientSettings:
    """The samples, deletions and concept vectors of the gradients.

    Attributes:
        samples: test samples of each source and seed whose points are deleted, balanced; all where there are fewer.
        deleted: shares of a cloud's points that are deleted.
        vectors: the number of concept vectors of each concept, and of random ones.
        level: TCAV's level of significance, over all its tests of a source and seed.
    """

    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)] = 30
    deleted: Distinct[OpenShare] = (0.05, 0.1, 0.25)
    vectors: Annotated[int, Bounds(minimum=2, maximum=1000)] = 20
    level: OpenShare = 0.05
