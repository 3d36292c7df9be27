"""Analytical features with GP-CA's classifier: what the learned embedding adds (docs/baselines.md)."""

from functools import partial
from typing import Annotated

import numpy as np

from gpca.classifier.settings import GPCArguments
from gpca.explainers.analytical_features import analytical_features
from gpca.explainers.gpca import GPCA
from gpca.explainers.interface import ExplainerEntry, measured
from gpca.pairs.dataset import Registrations
from gpca.settings import Bounds, Count


class AnalyticalGPC(GPCA):
    """GP-CA with analytical features in place of the embedding, the point-count ratio among them or not."""

    def __init__(
        self,
        source: str,
        seed: int,
        *,
        point_count: bool = True,
        shape_points: Count = 256,
        neighbours: Annotated[int, Bounds(minimum=4)] = 16,
        **settings: GPCArguments,
    ) -> None:
        super().__init__(source, seed, **settings)
        self._axes, self._point_count = (source, seed, "analytical"), point_count
        self._shape_points, self._neighbors = shape_points, neighbours
        self._prefix = "_".join(map(str, (*self._axes, shape_points, neighbours, "")))

    def describe(self, registrations: Registrations) -> Registrations:
        """Attach the features, the point-count ratio last, unless they are attached already."""
        measure = partial(analytical_features, shape_points=self._shape_points, neighbors=self._neighbors)
        return measured(registrations, self._prefix, lambda: {"features": measure(registrations, *self._axes)})

    def _inputs(self, registrations: Registrations) -> np.ndarray:
        features_N_F = self.describe(registrations).attached[f"{self._prefix}features"]
        return features_N_F if self._point_count else features_N_F[:, :-1]


EXPLAINERS = {
    "analytical_gpc": ExplainerEntry("Analytical features (GPC)", AnalyticalGPC, ("pair",)),
    "analytical_gpc_no_counts": ExplainerEntry(
        "Analytical features without point counts (GPC)", partial(AnalyticalGPC, point_count=False), ("pair",)
    ),
}
