"""Which pairs of a scene are registered: so many of each stratum of overlap, drawn from all that there are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

from gpca.scans.pair import ScanPair
from gpca.scans.scene import Scene
from gpca.seeds import generator


def stratum_name(low: float, high: float) -> str:
    """Return e.g. ``overlap_0.3_0.5``."""
    return f"overlap_{low:g}_{high:g}"


def stratum_of(overlap: float, edges: Sequence[float]) -> str | None:
    """Return the stratum that an overlap is in, the upper edge of the last one included; None where it is in none."""
    for low, high in pairwise(edges):
        if low <= overlap < high or (overlap == high == edges[-1]):
            return stratum_name(low, high)
    return None


def choose_pairs(scenes: Iterable[Scene], edges: Sequence[float], most: int, *axes: object) -> list[ScanPair]:
    """Return up to `most` pairs of each scene and stratum, stratum by stratum, scene by scene.

    Args:
        scenes: read one after another; no more than the chosen clouds are kept.
        edges: of the strata of overlap, ascending.
        axes: name the random numbers; a scene's draw does not depend on the other scenes.
    """
    chosen: dict[str, list[ScanPair]] = {stratum_name(*ends): [] for ends in pairwise(edges)}
    for scene in scenes:
        by_stratum: dict[str, list] = {name: [] for name in chosen}
        for known in scene.known():
            if (name := stratum_of(known.overlap or 0.0, edges)) is not None:
                by_stratum[name].append(known)
        for name, candidates in by_stratum.items():
            order = generator(*axes, scene.name, name, "pairs").permutation(len(candidates))
            chosen[name] += [scene.pair(candidates[i]) for i in sorted(order[:most])]
    return [pair for pairs in chosen.values() for pair in pairs]
