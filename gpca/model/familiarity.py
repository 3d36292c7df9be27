"""Comparison of two clouds with the training clouds of a model, by three measures of their geometry.

None depends on the pose. A pair may also be void: then its scores mean nothing, and the user should check the input.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from gpca.seeds import generator

MEASURES = ("size", "depth", "closure")
SHARE = 0.99  # share of the training samples within the range of each measure
SIZE_MARGIN = 1.1  # tolerance of the range of sizes: a sensor may show slightly less or more of an object
POINTS = 1024  # maximum number of points for hidden shares
DIRECTIONS = 32  # number of viewing directions
CELL, CELLS = 1 / 16, 64  # size of a picture's cell in diameters, and cells along an axis
BEHIND = 0.1  # depth behind the foremost point of a cell, in diameters, from which a point is hidden
FLAT = 0.15  # closure below which a thin object looks like one of its sides
FEWEST_MATCHES = 3  # with fewer points near the target, any rotation fits
FOREIGN = 2.0  # factor beyond the range of training sizes at which the scale must be wrong
BULK = 0.98  # share of the target's points that have to span at least ...
SMALLEST_BULK = 0.5  # ... this share of its diameter, the unit of all lengths


def measure(source: np.ndarray, target: np.ndarray) -> dict[str, float]:
    """Return `MEASURES` of a pair of clouds (N, 3) and (M, 3), both in diameters of the target.

    - size: ratio of the radii of gyration, source to target;
    - closure: :func:`hidden_share` of the target: 0.3 to 0.5 for a whole object, 0 to 0.2 for a view from one side;
    - depth: ratio of the hidden shares, source to target; NaN for thin targets.
    """
    closure = hidden_share(target)
    depth = hidden_share(source) / closure if closure >= FLAT else np.nan
    return {"size": relative_size(source, target), "depth": float(depth), "closure": closure}


def relative_size(source: np.ndarray, target: np.ndarray) -> float:
    """Return the ratio of the radii of gyration of two clouds (N, 3) and (M, 3)."""
    radii = [np.sqrt(cloud.var(axis=0).sum()) for cloud in (source, target)]
    return float(radii[0] / radii[1])


def hidden_share(points: np.ndarray) -> float:
    """Return the share of points (N, 3) hidden behind others, from the direction that hides the fewest."""
    points = points[generator("familiarity").permutation(len(points))[:POINTS]] - points.mean(axis=0)
    # Viewing directions are spread evenly over the sphere (Fibonacci); u and v span the picture.
    steps = np.arange(DIRECTIONS) + 0.5
    height, turn = 1 - 2 * steps / DIRECTIONS, np.pi * (1 + np.sqrt(5)) * steps
    ring = np.sqrt(1 - height**2)
    z_D_3 = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    u_D_3 = np.stack([-np.sin(turn), np.cos(turn), np.zeros(DIRECTIONS)], axis=1)
    frames_D_3_3 = np.stack([z_D_3, u_D_3, np.cross(z_D_3, u_D_3)], axis=1)
    z_D_N, u_D_N, v_D_N = np.moveaxis(frames_D_3_3 @ points.T, 1, 0)
    cell_D_N = [np.clip((w_D_N / CELL).astype(int) + CELLS // 2, 0, CELLS - 1) for w_D_N in (u_D_N, v_D_N)]
    number_D_N = (np.arange(DIRECTIONS)[:, None] * CELLS + cell_D_N[0]) * CELLS + cell_D_N[1]
    foremost = np.full(DIRECTIONS * CELLS**2, -np.inf)
    np.maximum.at(foremost, number_D_N, z_D_N)
    return float((z_D_N < foremost[number_D_N] - BEHIND).mean(axis=1).min())


@dataclass(frozen=True)
class Familiarity:
    """The range (low, high) of each measure over the training samples: it contains at least `SHARE` of them."""

    ranges: Mapping[str, tuple[float, float]]

    @classmethod
    def of(cls, pairs: Iterable[tuple[np.ndarray, np.ndarray]]) -> Familiarity:
        """Measure the training samples.

        Args:
            pairs: source and target of each, in diameters.
        """
        measured = [measure(*pair) for pair in pairs]
        ends = ((1 - SHARE) / 2, (1 + SHARE) / 2)
        ranges = {}
        for name in MEASURES:
            values = np.array([measures[name] for measures in measured])
            values = values[np.isfinite(values)]
            low, high = np.quantile(values, ends).tolist() if len(values) else (0.0, np.inf)
            margin = SIZE_MARGIN if name == "size" else 1.0
            ranges[name] = low / margin, high * margin
        return cls(ranges)

    def warnings(self, source: np.ndarray, target: np.ndarray) -> list[str]:
        """Return a line for each measure of the pair outside its range; see :func:`measure`."""
        measured = measure(source, target)
        below = {name for name, (low, _) in self.ranges.items() if measured[name] < low}
        above = {name for name, (_, high) in self.ranges.items() if measured[name] > high}
        between = " to ".join(f"{end:.2g}" for end in self.ranges["size"])
        lines = {
            f"the source is {measured['size']:.2g} times as large as the target; in training it was {between} times: "
            "are both in the same unit and scale?": "size" in below | above,
            "the source shows the object from all sides, but GP-CA was trained on partial views": "depth" in above,
            "the source shows the object from one side alone, but GP-CA was trained on clouds that show more of it": (
                "depth" in below
            ),
            "the target looks like a view from one side: give the whole object": "closure" in below,
        }
        return [line for line, holds in lines.items() if holds]


@dataclass(frozen=True)
class Void:
    """A fault of the pair, and what the user should check."""

    fault: str
    check: str

    def __str__(self) -> str:
        return f"{self.fault}, so the scores are meaningless: check {self.check}"


def voids_of(source: np.ndarray, target: np.ndarray, fitness: float, familiar: Familiarity | None) -> list[Void]:
    """Return the faults that leave an explanation without meaning, if any.

    Args:
        source, target: (N, 3) and (M, 3) in diameters of the target.
        fitness: share of source points with a correspondence at the result.
        familiar: ranges of the training clouds, if the model has them.
    """
    voids = []
    if (matches := round(fitness * len(source))) < FEWEST_MATCHES:
        ended = f"only {matches} of the source's points" if matches else "no source point"
        voids.append(Void(f"{ended} ended near the target", "the initial pose and the unit"))
    if familiar is not None:
        low, high = familiar.ranges["size"]
        if not low / FOREIGN <= relative_size(source, target) <= high * FOREIGN:
            voids.append(Void("source and target differ in scale", "the unit and scale of both"))
    # Twice the radius about the median that contains the share `BULK` of the points.
    bulk = 2 * float(np.quantile(np.linalg.norm(target - np.median(target, axis=0), axis=1), BULK))
    if bulk < SMALLEST_BULK:
        span = f"{BULK:.0%} of the target's points span {bulk:.2g} of its diameter"
        voids.append(Void(span, "the target for points far from the object"))
    return voids
