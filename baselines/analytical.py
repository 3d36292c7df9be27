"""Analytical features and the same GPC as GP-CA: what the learned embedding adds (the paper's feature ablation).

In this dataset a cropped cloud has fewer points than the others, so the point-count ratio alone gives the concept
overlap away, which no sensor does. Hence two rows: `analytical_gpc` with the paper's list, and
`analytical_gpc_no_counts` without the ratio.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from time import perf_counter

import numpy as np

from gpca.attribution.scores import Attribution
from gpca.explainers.analytical_features import analytical_features
from gpca.explainers.gpca import GPCA
from gpca.explainers.interface import ExplainerEntry, measured
from gpca.pairs.dataset import Registrations


class AnalyticalGPC:
    """GP-CA with analytical features in place of the embedding.

    Args:
        source, seed: name the draws.
        point_count: whether the point-count ratio is among the features.
        shape_points: source points at which local shape is measured, drawn by split and sample; all where there are
            fewer.
        neighbours: how many points, itself included, make a point's local shape.
        settings: those of the GPC, as for GP-CA.
    """

    def __init__(
        self,
        source: str,
        seed: int,
        *,
        point_count: bool = True,
        shape_points: int = 256,
        neighbours: int = 16,
        **settings,
    ) -> None:
        self._axes = (source, seed, "analytical")
        self._point_count = point_count
        self._shape_points = shape_points
        self._neighbours = neighbours
        self._gpca = GPCA(source, seed, **settings)

    def fit(self, registrations: Registrations) -> None:
        """Fit the GPC to the features of the labelled registrations."""
        self._gpca.fit(self._with_features(registrations))

    def explain(self, registrations: Registrations) -> Attribution:
        """Draw from the posterior at every registration's features and summarise, as GP-CA does."""
        started = perf_counter()
        described = self._with_features(registrations)
        seconds = (perf_counter() - started) / len(registrations)
        attribution = self._gpca.explain(described)
        return replace(attribution, seconds_N=attribution.seconds_N + seconds)

    def describe(self, registrations: Registrations) -> Registrations:
        """Attach the features, the point-count ratio last, unless they are attached already."""
        measure = partial(analytical_features, shape_points=self._shape_points, neighbours=self._neighbours)
        return measured(registrations, self._prefix, lambda: {"features": measure(registrations, *self._axes)})

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the features (N, F) of :func:`gpca.explainers.analytical_features.analytical_features`."""
        features_N_F = self.describe(registrations).attached[f"{self._prefix}features"]
        return features_N_F if self._point_count else features_N_F[:, :-1]

    @property
    def _prefix(self) -> str:
        return "_".join(map(str, (*self._axes, self._shape_points, self._neighbours, "")))

    def _with_features(self, registrations: Registrations) -> Registrations:
        return replace(registrations, attached={"embedding": self.features(registrations)})


EXPLAINERS = {
    "analytical_gpc": ExplainerEntry("Analytical features (GPC)", AnalyticalGPC),
    "analytical_gpc_no_counts": ExplainerEntry(
        "Analytical features without point counts (GPC)", partial(AnalyticalGPC, point_count=False)
    ),
}
