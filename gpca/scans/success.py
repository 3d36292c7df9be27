"""When a registration of scans is correct: by the RMSE over the surface that both scans truly have in common.

That is the criterion of 3DMatch (Zeng et al. 2017, after Choi et al. 2015): over the true correspondences (p, q), the
root mean square of \\|T p - q\\| has to be below 0.2 m. Here q is the true place of p, as in the benchmark's own code,
which evaluates the same sum to second order from a 6×6 matrix of each pair.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpca.alignment.rigid import transform
from gpca.scans.pair import ScanPair
from gpca.settings import Positive, PositiveShare

FEWEST_COMMON = 3  # points


@dataclass(frozen=True)
class ScanSuccess:
    """Limits of the RMSE over the true overlap, from which a registration has failed.

    Attributes:
        room_m: in rooms, in meters.
        object_share: of objects, relative to their size.
    """

    room_m: Positive = 0.2
    object_share: PositiveShare = 0.02

    def limit_m(self, pair: ScanPair) -> float:
        """Return the limit of a pair, in meters."""
        return self.room_m if pair.kind == "room" else self.object_share * pair.size_m


def overlap_rmse(pair: ScanPair, T_target_source: np.ndarray) -> float:
    """Return the root mean square distance (m) of the common points of the source from their true places.

    Common are those of :attr:`ScanPair.source_common_N`; all points count where fewer than three are common.
    """
    common_N = pair.source_common_N
    points_n_3 = pair.source_N_3[common_N] if common_N.sum() >= FEWEST_COMMON else pair.source_N_3
    moved_n_3 = transform(T_target_source, points_n_3) - transform(pair.T_target_source, points_n_3)
    return float(np.sqrt(np.square(moved_n_3).sum(axis=1).mean()))
