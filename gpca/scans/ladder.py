"""Starts of local methods: the true pose, disturbed by the rungs of a ladder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from gpca.alignment.rigid import random_direction, rigid_motion, rotate
from gpca.scans.pair import ScanPair
from gpca.seeds import generator
from gpca.settings import Bounds, NotNegative


@dataclass(frozen=True)
class Rung:
    """A disturbance of a pose.

    Attributes:
        rotation_deg: about a random axis through the middle of the source.
        translation_m: in a random direction, in a room; for objects times :attr:`ScanPair.scale`.
    """

    rotation_deg: Annotated[float, Bounds(minimum=0, maximum=180)]
    translation_m: NotNegative

    @property
    def name(self) -> str:
        """E.g. ``20deg_0.25m``."""
        return f"{self.rotation_deg:g}deg_{self.translation_m:g}m"


def rungs_of(pairs: int, ladder: Sequence[Rung], *axes: object) -> list[Rung]:
    """Return the rung of each pair: of as many pairs in a row as there are rungs each has another, in a drawn order.

    So every stratum and scene meets all rungs, with no more of one than of another.
    """
    random, order = generator(*axes, "rungs"), list[int]()
    while len(order) < pairs:
        order += random.permutation(len(ladder)).tolist()
    return [ladder[i] for i in order[:pairs]]


def disturbed(pair: ScanPair, rung: Rung, *axes: object) -> np.ndarray:
    """Return ``T_target_source`` (4×4) of a start on a rung; the axes, with pair and rung, name the random numbers."""
    from scipy.spatial.transform import Rotation

    random = generator(*axes, pair.name, rung.name, "start")
    R = Rotation.from_rotvec(np.deg2rad(rung.rotation_deg) * random_direction(random)).as_matrix()
    middle_3 = rotate(pair.T_target_source, pair.source_N_3.mean(axis=0)) + pair.T_target_source[:3, 3]
    shift_3 = rung.translation_m * pair.scale * random_direction(random)
    return rigid_motion(R, middle_3 - rotate(R, middle_3) + shift_3) @ pair.T_target_source
