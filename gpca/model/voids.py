"""Pairs whose explanation has no meaning, so that no output of a model counts.

Unlike a warning of what was rare in the training, each of these leaves no state but `UNKNOWN`, and nothing to do but to
check what was given.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpca.model.familiarity import Familiarity

FEWEST_MATCHES = 3  # with fewer points near the target, any rotation fits
FOREIGN = 2.0  # times beyond the sizes of the training, the source is of another scale
BULK = 0.98  # share of the target's points that have to span ...
SMALLEST_BULK = 0.5  # ... as much of its diameter, by which everything is measured


@dataclass(frozen=True)
class Void:
    """A fault of the pair, and what the user should check."""

    fault: str
    check: str

    def __str__(self) -> str:
        return f"{self.fault}, so the scores are meaningless: check {self.check}"


def voids_of(source: np.ndarray, target: np.ndarray, fitness: float, familiar: Familiarity | None) -> list[Void]:
    """Return the faults that leave the explanation of a registration without meaning, if any.

    Args:
        source, target: (N, 3) and (M, 3) in diameters of the target.
        fitness: share of source points with a correspondence where the registration ended.
        familiar: ranges of the clouds of the training, if the model has them.
    """
    found = []
    if (matches := round(fitness * len(source))) < FEWEST_MATCHES:
        ended = f"only {matches} of the source's points" if matches else "no source point"
        found.append(Void(f"{ended} ended near the target", "the initial pose and the unit"))
    if familiar is not None and familiar.is_foreign(source, target, FOREIGN):
        found.append(Void("source and target differ in scale", "the unit and scale of both"))
    if (bulk := _bulk(target)) < SMALLEST_BULK:
        span = f"{BULK:.0%} of the target's points span {bulk:.2g} of its diameter"
        found.append(Void(span, "the target for points far from the object"))
    return found


def _bulk(points: np.ndarray) -> float:
    """Return twice the radius about the median that holds the share `BULK` of points (N, 3)."""
    return 2 * float(np.quantile(np.linalg.norm(points - np.median(points, axis=0), axis=1), BULK))
