"""Packs one registration of a run for the page's 3-D view, as pages of explanations do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gpca.alignment.rigid import inverse, transform
from gpca.causes.shapley import BY_SIZE
from gpca.model.scene import flat, packed, packed_pair, taken_out
from gpca.pairs.dataset import Registrations
from gpca.reporting.figures.cloud_views import thinned

POINTS = 600  # The page shows at most this many points of a cloud.
UNIT, DIAMETER = "% of the diameter", 100  # in which the page says lengths
TRUTH = "pose:0"  # the view of the true pose


def packed_registration(
    registrations: Registrations, row: int, reach: float, observed_8: Sequence[np.ndarray] = ()
) -> dict:
    """Return what ``view.js`` draws of a registration: where it began, where it ended, where it should have.

    Args:
        registrations: of a run.
        row: which of them.
        reach: how far ICP looks for a partner, in diameters.
        observed_8: the observed cloud (P, 3) where ICP put it with each subset of the causes, in the order of
            :data:`gpca.causes.shapley.SUBSETS`; none where nothing was measured. Subsets that are the same registration
            are packed once, and the others are its place.
    """
    target = thinned(registrations.target(row).astype(float), POINTS)
    T_centered = np.eye(4)
    T_centered[:3, 3] = -(target.min(axis=0) + target.max(axis=0)) / 2
    T_init, T_icp, T_true = (T_centered @ registrations.T_target_source(name, row) for name in ("init", "icp", "true"))
    source = transform(T_init, thinned(registrations.source(row), POINTS))
    pair = packed_pair(transform(T_centered, target), source, T_icp @ inverse(T_init), reach, DIAMETER, UNIT)
    what_ifs: list[dict | int] = []
    for subset in BY_SIZE if observed_8 else ():
        cloud = packed(transform(T_centered, thinned(observed_8[subset], POINTS)))
        what_ifs.append(what_ifs.index(cloud) if cloud in what_ifs else cloud)
    words = {f"what:0:{place}": f"Registered again, {_lower(subset)}" for place, subset in enumerate(BY_SIZE)}
    return pair | {
        "poses": [{"T": flat(T_true @ inverse(T_init)), "what_ifs": what_ifs}],
        "titles": {TRUTH: "In the true pose"} | (words if what_ifs else {}),
    }


def _lower(subset: int) -> str:
    words = taken_out(subset)
    return words[:1].lower() + words[1:]
