"""Settings of the registrations for the estimators of covariance, apart from the code that runs them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

import numpy as np

from gpca.settings import Bounds, PositiveShare
from gpca.uncertainty.settings import start_deviation

Kind = Literal["starts", "data", "all"]  # of a reference: what varies in it
KINDS: tuple[Kind, ...] = get_args(Kind)
REFERENCES = tuple(f"reference_{kind}" for kind in KINDS)  # by these names they have rows among the estimators
# By which an estimator is judged, by what it models. No posterior can be drawn here; a right one is about as wide as
# the results of other data.
REFERENCE_OF: dict[str, Kind] = {
    **{"starts": "starts", "data": "data", "posterior": "data"},
    **{"starts and data": "all", "error": "all"},
}
OTHER_SOURCE, MILD = "other_source", "mild"  # what a learner is trained with, for its name
SHIFTS = {OTHER_SOURCE: "trained on another dataset", MILD: "trained on mild severities"}


@dataclass(frozen=True)
class EstimatorPairSettings:
    """The registrations whose covariance is estimated, and the reference that estimates are compared with.

    Attributes:
        methods: registration method -> test registrations of each source and seed, at most.
        train: training registrations by each method, for estimators that learn, at most.
        train_starts: runs of each of them, with other data and starts.
        points: of source and of target (fewer where a cloud has fewer).
        repeats: registrations of each reference.
        start_rotation_deg, start_translation: root mean square angle and length of all starts' offsets.
        floor: variance that is added to every covariance before it is judged; a spread below it counts as none.
        failed: error from which a registration has failed, ADD or ADD-S in diameters: the config's ``success.error``.
    """

    methods: dict[str, Annotated[int, Bounds(minimum=1, maximum=100_000)]]
    train: Annotated[int, Bounds(minimum=8)]
    train_starts: Annotated[int, Bounds(minimum=7, maximum=1000)]
    points: Annotated[int, Bounds(minimum=64, maximum=65536)]
    repeats: Annotated[int, Bounds(minimum=20, maximum=100_000)]
    start_rotation_deg: Annotated[float, Bounds(exclusiveMinimum=0, maximum=180)]
    start_translation: Annotated[float, Bounds(exclusiveMinimum=0, maximum=10)]
    floor: Annotated[float, Bounds(exclusiveMinimum=0, maximum=1)]
    failed: PositiveShare

    def deviation_6(self) -> np.ndarray:
        """Standard deviations (σ_rot ×3, σ_t ×3) of a start's twist, in radians and diameters."""
        return start_deviation(self.start_rotation_deg, self.start_translation)
