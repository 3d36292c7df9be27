"""Whether two clouds are like those that a model learned: unlike clouds cannot be explained, only guessed at.

Three numbers of simple geometry, whose ranges over the training samples are kept with the model. None depends on the
pose but that of size, which is measured about the clouds' own centers.

A pair may also be void: unlike a warning of what was rare in the training, each such fault leaves no state but
`UNKNOWN`, and nothing to do but to check what was given.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from gpca.seeds import generator

MEASURES = ("size", "depth", "closure")
SHARE = 0.99  # of the training samples lies within the range of each measure
SIZE_MARGIN = 1.1  # by which a source may be larger or smaller still: a sensor may show a little less or more of it
POINTS = 1024  # at most; of a cloud whose depth is measured
DIRECTIONS = 32  # from which a cloud is looked at
CELL, CELLS = 1 / 16, 64  # diameters, and cells along an axis of the picture
BEHIND = 0.1  # diameters behind the foremost point of a cell, from which on a point is hidden
FLAT = 0.15  # closure below which a thin object looks the same as one side of it
FEWEST_MATCHES = 3  # with fewer points near the target, any rotation fits
FOREIGN = 2.0  # times beyond the sizes of the training, the source is of another scale
BULK = 0.98  # share of the target's points that have to span ...
SMALLEST_BULK = 0.5  # ... as much of its diameter, by which everything is measured


def measure(source: np.ndarray, target: np.ndarray) -> dict[str, float]:
    """Return `MEASURES` of a pair of clouds (N, 3) and (M, 3), both in diameters of the target.

    - size: radius of gyration of the source in that of the target.
    - closure: share of the target's points that is hidden behind others, from the direction that hides fewest: 0.3 to
      0.5 of an object with a front and a back, 0 to 0.2 of a view from one side.
    - depth: the same share of the source in that of the target; NaN where this is a thin object.
    """
    closure = hidden_share(target)
    depth = hidden_share(source) / closure if closure >= FLAT else np.nan
    return {"size": relative_size(source, target), "depth": float(depth), "closure": closure}


def relative_size(source: np.ndarray, target: np.ndarray) -> float:
    """Return the radius of gyration of points (N, 3) in that of others (M, 3)."""
    radii = [np.sqrt(cloud.var(axis=0).sum()) for cloud in (source, target)]
    return float(radii[0] / radii[1])


def hidden_share(points: np.ndarray) -> float:
    """Return the share of points (N, 3) that are hidden behind others, from the direction that hides fewest."""
    points = points[generator("familiarity").permutation(len(points))[:POINTS]] - points.mean(axis=0)
    z_D_N, u_D_N, v_D_N = np.moveaxis(_frames() @ points.T, 1, 0)
    cell_D_N = [np.clip((w_D_N / CELL).astype(int) + CELLS // 2, 0, CELLS - 1) for w_D_N in (u_D_N, v_D_N)]
    number_D_N = (np.arange(DIRECTIONS)[:, None] * CELLS + cell_D_N[0]) * CELLS + cell_D_N[1]
    foremost = np.full(DIRECTIONS * CELLS**2, -np.inf)
    np.maximum.at(foremost, number_D_N, z_D_N)
    return float((z_D_N < foremost[number_D_N] - BEHIND).mean(axis=1).min())


def _frames() -> np.ndarray:
    """Return (D, 3, 3) axes: a direction of view, spread evenly over the sphere (Fibonacci), and two across it."""
    steps = np.arange(DIRECTIONS) + 0.5
    height, turn = 1 - 2 * steps / DIRECTIONS, np.pi * (1 + np.sqrt(5)) * steps
    ring = np.sqrt(1 - height**2)
    z_D_3 = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    u_D_3 = np.stack([-np.sin(turn), np.cos(turn), np.zeros(DIRECTIONS)], axis=1)
    return np.stack([z_D_3, u_D_3, np.cross(z_D_3, u_D_3)], axis=1)


@dataclass(frozen=True)
class Familiarity:
    """The range (low, high) of each measure, which holds `SHARE` of the training samples, or more."""

    ranges: Mapping[str, tuple[float, float]]

    @classmethod
    def of(cls, pairs: Iterable[tuple[np.ndarray, np.ndarray]]) -> Familiarity:
        """Measure the training samples: source and target of each, in diameters."""
        measured = [measure(*pair) for pair in pairs]
        ends = ((1 - SHARE) / 2, (1 + SHARE) / 2)
        ranges = {}
        for name in MEASURES:
            values = np.array([of_pair[name] for of_pair in measured])
            values = values[np.isfinite(values)]
            low, high = np.quantile(values, ends).tolist() if len(values) else (0.0, np.inf)
            margin = SIZE_MARGIN if name == "size" else 1.0
            ranges[name] = low / margin, high * margin
        return cls(ranges)

    def is_foreign(self, source: np.ndarray, target: np.ndarray, factor: float) -> bool:
        """Return whether the source's size in that of the target lies `factor` times beyond its range."""
        low, high = self.ranges["size"]
        return not low / factor <= relative_size(source, target) <= high * factor

    def warnings(self, source: np.ndarray, target: np.ndarray) -> list[str]:
        """Return a line for each measure of the pair that lies outside its range; see :func:`measure`."""
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
    """Return the faults that leave the explanation of a registration without meaning, if any.

    Args:
        source, target: (N, 3) and (M, 3) in diameters of the target.
        fitness: share of source points with a correspondence where the registration ended.
        familiar: ranges of the clouds of the training, if the model has them.
    """
    voids = []
    if (matches := round(fitness * len(source))) < FEWEST_MATCHES:
        ended = f"only {matches} of the source's points" if matches else "no source point"
        voids.append(Void(f"{ended} ended near the target", "the initial pose and the unit"))
    if familiar is not None and familiar.is_foreign(source, target, FOREIGN):
        voids.append(Void("source and target differ in scale", "the unit and scale of both"))
    if (bulk := _bulk(target)) < SMALLEST_BULK:
        span = f"{BULK:.0%} of the target's points span {bulk:.2g} of its diameter"
        voids.append(Void(span, "the target for points far from the object"))
    return voids


def _bulk(points: np.ndarray) -> float:
    """Return twice the radius about the median that holds the share `BULK` of points (N, 3)."""
    return 2 * float(np.quantile(np.linalg.norm(points - np.median(points, axis=0), axis=1), BULK))
