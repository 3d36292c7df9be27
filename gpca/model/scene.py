"""What an explanation is drawn from: both clouds, the poses, and the registrations that were re-enacted.

A scene keeps arrays that the explanation had anyway. It re-enacts once more when it is drawn, with the same numbers, so
that an explanation that nobody looks at costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gpca.alignment.canonical_frame import CanonicalFrame
from gpca.alignment.rigid import transform
from gpca.causes.counterfactuals import Registrar, Unmeasurable
from gpca.causes.settings import CauseSettings
from gpca.causes.shapley import SUBSETS
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.enactment import Enactment
from gpca.reenactment.hypotheses import weights_of


@dataclass(frozen=True)
class WhatIf:
    """One of the eight re-enacted registrations under a hypothesis, in the target's frame and in its diameters.

    Attributes:
        causes: which causes were left in; the others were taken out.
        error: v̂, the mean over the starts.
        points: (P, 3) the cloud where one registration, from the start itself, put it.
    """

    causes: tuple[str, ...]
    error: float
    points: np.ndarray


@dataclass(frozen=True)
class Possibility:
    """A pose that may be the true one, and what the registration would have done.

    Attributes:
        probability: among all such poses.
        T: 4×4, takes the source from where the registration began to this pose.
        what_ifs: of all subsets of the causes, in the order of :data:`gpca.causes.shapley.SUBSETS`.
    """

    probability: float
    T: np.ndarray
    what_ifs: tuple[WhatIf, ...]


@dataclass(frozen=True)
class Scene:
    """A registration in the target's canonical frame and in its diameters.

    Attributes:
        source: (N, 3) where the registration began.
        target: (M, 3).
        T_found: 4×4, takes the source from there to where the registration ended.
        frame: of the target, in the user's unit.
        reach: how far ICP looked for a partner, in diameters.
        limit: error above which the registration has failed, in diameters.
        enact: re-enacts once more, with the same numbers, and says how; None where nothing was re-enacted.
    """

    source: np.ndarray
    target: np.ndarray
    T_found: np.ndarray
    frame: CanonicalFrame
    reach: float
    limit: float
    enact: Callable[[], tuple[list[Enactment], CauseSettings]] | None = None

    @property
    def aligned(self) -> np.ndarray:
        """The source (N, 3) where the registration put it."""
        return transform(self.T_found, self.source)

    @cached_property
    def possibilities(self) -> tuple[Possibility, ...]:
        """The poses that fit, the most probable first; none where nothing was re-enacted."""
        if self.enact is None:
            return ()
        enactments, truth = self.enact()
        weight_k = weights_of(enactment.hypothesis for enactment in enactments)
        return tuple(
            Possibility(float(weight), enactment.hypothesis.T, _what_ifs(enactment, truth))
            for enactment, weight in zip(enactments, weight_k, strict=True)
        )


def _what_ifs(enactment: Enactment, truth: CauseSettings) -> tuple[WhatIf, ...]:
    candidate, registrar = enactment.candidate, Registrar(enactment.candidate, truth, misses=True)
    found = []
    for subset, causes in enumerate(SUBSETS):
        applied = tuple(cause for cause in causes if candidate.applied[cause])
        try:
            T = registrar.run(applied, np.zeros((1, 6))).T_target_source_n[0]
        except Unmeasurable:
            T = candidate.start(applied)
        names = tuple(CONCEPTS[cause] for cause in causes)
        found.append(WhatIf(names, float(enactment.error_8[subset]), transform(T, candidate.observed(applied))))
    return tuple(found)
