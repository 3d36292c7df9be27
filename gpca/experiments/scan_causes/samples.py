"""Chooses where the registrations of pairs of scans begin that are measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from gpca.causes.scans import GLOBAL, LADDER, ScanStart
from gpca.experiments.scan_causes.settings import ScanSamples
from gpca.scans.pair import Rung, ScanPair, disturbed
from gpca.scans.scene import ScanPairs
from gpca.seeds import generator

GlobalMethod = Callable[[ScanPair], np.ndarray | None]  # returns T_target_source (4×4), meters; None where it fails


def starts_of(
    pairs: ScanPairs,
    source: str,
    seed: int,
    settings: ScanSamples,
    ladder: Sequence[Rung],
    methods: Mapping[str, GlobalMethod],
) -> list[ScanStart]:
    """Return the starts, pair by pair: drawn rungs, the poses of global methods, and a rung with noise added.

    A perfect start is no rung that is drawn: a pose error that is not there would give itself away.

    Args:
        ladder: of starts.
        methods: the global ones, by name.
    """
    rungs = [rung for rung in ladder if rung.rotation_deg or rung.translation_m]
    starts: list[ScanStart] = []
    for k, pair in enumerate(pairs):
        order = generator(source, seed, "scan causes", pair.name, "rungs").permutation(len(rungs))
        drawn = [rungs[row] for row in order[: settings.ladder_starts]]
        poses = {rung.name: disturbed(pair, rung, source, seed) for rung in drawn}
        results = {name: register(pair) for name, register in methods.items()}
        known = {name: pose for name, pose in results.items() if pose is not None}
        found = tuple(known.values())
        starts += [ScanStart(k, LADDER, name, pose, found=found) for name, pose in poses.items()]
        starts += [ScanStart(k, GLOBAL, name, pose, found=found) for name, pose in known.items()]
        if settings.times and drawn:
            times = settings.times[k % len(settings.times)]
            starts.append(ScanStart(k, LADDER, drawn[0].name, poses[drawn[0].name], times, found))
    return starts
