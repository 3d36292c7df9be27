"""The search of the re-enactment as a registration method: EM from many starts, with or without the initial pose.

As in coherent point drift (Myronenko & Song 2010) and FilterReg (Gao & Tedrake 2019), the source's points are normal
around the target's, or outliers, and expectation maximization moves the pose. Both of these climb from one start; here
the likeliest of many ends is the result (:mod:`gpca.reenactment.hypotheses`).
"""

from __future__ import annotations

from functools import partial

import numpy as np

from gpca.alignment.methods.interface import (
    CORRESPONDENCE_DISTANCE,
    FEWEST,
    FailedRegistration,
    MethodEntry,
    Outcome,
    Pair,
)
from gpca.reenactment.hypotheses import find_hypotheses, log_prior, rotations, weights_of
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import inverse, rigid_motion, scale_translation, transform
from gpca.seeds import generator
from gpca.settings import Positive

TURNS = 96  # starts at turns of any size, where there is no initial pose


def pose_posterior(
    pair: Pair, settings: ReenactmentSettings, prior: bool = True, unit: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return probable poses T_target_source (K, 4, 4), the best first, and their probabilities (K,).

    With a prior, the initial pose is believed in as the settings say; without, it is not read. The search takes `unit`
    for the diameter of the target.
    """
    T_frame_target = np.eye(4)
    T_frame_target[:3, 3] = -pair.target.mean(axis=0)
    T_init = pair.T_target_source_init if prior else _onto_center(pair)
    T_frame_source = T_frame_target @ T_init
    before, target = (
        transform(T, points) / unit for T, points in ((T_frame_source, pair.source), (T_frame_target, pair.target))
    )
    if min(len(np.unique(points, axis=0)) for points in (before, target)) < FEWEST:
        raise FailedRegistration(f"fewer than {FEWEST} different points")
    random = generator("registration", "posterior", pair.seed)
    given = (before, ModelSurface(target))
    if prior:
        hypotheses = find_hypotheses(*given, np.empty((0, 4, 4)), settings, random)
    else:
        R_n = rotations(TURNS, 180.0)
        about_center_n = rigid_motion(R_n, np.zeros((len(R_n), 3)))
        hypotheses = find_hypotheses(
            *given, about_center_n, settings, random, lambda T, _width: -log_prior(T, settings)
        )
    back = inverse(T_frame_target)
    poses = [back @ scale_translation(hypothesis.T, unit) @ T_frame_source for hypothesis in hypotheses]
    return np.stack(poses), weights_of(hypotheses)


def _onto_center(pair: Pair) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = pair.target.mean(axis=0) - pair.source.mean(axis=0)
    return T


def align(
    prior: bool, pair: Pair, correspondence_distance: float = CORRESPONDENCE_DISTANCE, unit: Positive = 1.0
) -> Outcome:
    """Return the likeliest pose; `unit` is taken for the diameter of the target."""
    (T, *_), _ = pose_posterior(pair, ReenactmentSettings(), prior, unit)
    return Outcome.at(pair, T, correspondence_distance)


METHODS = {
    "posterior": MethodEntry("EM from many starts, initial pose as prior", partial(align, True)),
    "posterior_global": MethodEntry("EM from many starts", partial(align, False), is_global=True),
}
