"""The same registrations by another method, as encoders and descriptors then see them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gpca.alignment.methods.registry import make_method
from gpca.alignment.rigid import scale_translation, transform
from gpca.experiments.registration_methods.trial import pair_to_register
from gpca.pairs.dataset import Registrations, ragged
from gpca.process.progress import progress


def registered_by(
    registrations: Registrations, methods: Mapping[str, Mapping], source: str, seed: int, points: int
) -> dict[str, tuple[Registrations, np.ndarray]]:
    """Return for each method the registrations as it makes them, and why each failed (S,), empty if it did not.

    All methods get the same thinned clouds and the initial pose, which global ones do not read. The whole observed
    cloud moves to the pose that was found; a registration that failed stays where the method left it, and counts.

    Raises:
        InputError: an unknown method or setting, or a missing package.
    """
    made = {name: make_method(name, given) for name, given in methods.items()}
    outcomes: dict[str, list] = {name: [] for name in made}
    for row in progress(range(len(registrations)), f"registrations by other methods of {source}, seed {seed}"):
        pair = pair_to_register(registrations, row, source, seed, points)
        for name, method in made.items():
            outcomes[name].append(method(pair))
    targets = [registrations.target(row) for row in range(len(registrations))]
    found = {}
    for name, of_method in outcomes.items():
        clouds = [
            transform(outcome.T_target_source, registrations.source(row)).astype(np.float32)
            for row, outcome in enumerate(of_method)
        ]
        moved: dict[str, Any] = ragged(clouds, targets)
        poses = zip((outcome.T_target_source for outcome in of_method), registrations.diameter_m, strict=True)
        anew = replace(
            registrations,
            **moved,
            T_target_source_icp=np.array([scale_translation(T, diameter_m) for T, diameter_m in poses]),
            fitness=np.array([outcome.fitness for outcome in of_method]),
            inlier_rmse=np.array([outcome.inlier_rmse for outcome in of_method]),
            attached={},
        )
        found[name] = anew, np.array([outcome.failure for outcome in of_method])
    return found
