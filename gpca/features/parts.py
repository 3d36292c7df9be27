"""The descriptors of a pair by what has to be seen for them (:mod:`gpca.explainers.sight`), and so by their cost."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from gpca.causes.shapley import SUBSETS
from gpca.features.settings import DENSITIES, GROUPS, MOTION, QUANTILES, REMEDIED
from gpca.pairs.perturbation import POSE

Columns = Mapping[str, slice | list[int]]  # group -> those of its columns
EVERY = slice(None)
EVERYTHING: Columns = dict.fromkeys(GROUPS, EVERY)
# Every other quantile of the three distances, and all of the motion.
RESIDUALS: Columns = {"distances": slice(0, 3 * QUANTILES, 2), "motion": EVERY}

_MOVED, _FIT, _SPREAD = MOTION[:3], MOTION[3:5], MOTION[5:]
_QUICK = [
    name
    for name in REMEDIED
    if name in ("outliers", "smoothed")
    # The errors of the others are relative to the result with all remedies, a restart among them.
    or name in [f"{what}_{i}" for what in ("moved", "cost", "fitness") for i, of in enumerate(SUBSETS) if POSE in of]
]
COLUMNS: Mapping[str, Columns] = {
    # The observed cloud's thickness, spacing, extent and number of points.
    "source": {"distances": slice(3 * QUANTILES, None), "planes": DENSITIES[::2]},
    "pair": {"distances": EVERY, "planes": EVERY, "entropy": EVERY, "motion": [MOTION.index(name) for name in _FIT]},
    "motion": {"motion": [MOTION.index(name) for name in _MOVED]},
    "runs": {"motion": [MOTION.index(name) for name in _SPREAD], "starts": EVERY},
    "quick_remedies": {"remedied": [REMEDIED.index(name) for name in _QUICK]},
    "remedies": {"remedied": EVERY},
}


def seen(arrays: Mapping[str, np.ndarray], sees: Collection[str], wanted: Columns = EVERYTHING) -> np.ndarray:
    """Return the wanted descriptors that these parts show, side by side (N, F) in the order of `GROUPS`.

    Args:
        arrays: group -> (N, F).
        sees: keys of `COLUMNS`.
        wanted: the columns of each group in question.
    """
    chosen = []
    for group in (name for name in GROUPS if name in wanted):
        array_N_F = arrays[group]
        numbers_F = np.arange(array_N_F.shape[1])
        shown = [numbers_F[COLUMNS[part][group]] for part in sees if group in COLUMNS[part]]
        if shown:
            chosen.append(array_N_F[:, np.intersect1d(numbers_F[wanted[group]], np.concatenate(shown))])
    return np.hstack(chosen)
