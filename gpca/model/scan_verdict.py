"""Whether a registration of two scans may have failed, by numbers that need no training, and what to do then.

The probability of a failure is the mean of two. One is that of the poses that fit: each is refined on all voxels,
weighed by how well the scans fit there, and says how far the result lies from it. The other is how closely the scans
lie on each other at the result: two samples of one surface, a point per voxel, lie some 0.6 voxels apart, surfaces that
only cross about 1.1. Both together ranked failures better than either on the development scenes of 3DMatch, where the
constants were chosen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import expit

from gpca.alignment.pose_error import displacements
from gpca.alignment.rigid import inverse, transform
from gpca.causes.truth import FAILED, NOMINAL
from gpca.model.advice import CHECK
from gpca.model.reenacted import Reenacted
from gpca.model.scan_explanation import NOT_SURE
from gpca.model.scan_registration import Scans
from gpca.recovery.policy import NOTHING, TREATMENTS
from gpca.reenactment.enactment import Enactment
from gpca.reenactment.hypotheses import INDEPENDENT

LIMIT = 0.05  # of the target's extent: an error above it is a failure; 0.2 m of 4 m, as in rooms
STEEPNESS = 8.0  # of the probability of a failure in the logarithm of the error, as in the re-enactment's verdict
CLOSE = 0.8  # voxels between partners, root mean square, where a failure is as likely as not
CLOSE_STEEPNESS = 16.0  # of the probability in the logarithm of this distance
GOOD, BAD = 0.2, 0.5  # probabilities of a failure below which none is feared, and from which it is called one
LEAST_OVERLAP = 0.2  # of the source; with less, a wrong pose fits as well as the right one
LEAST = 1e-6  # of what logarithms are taken of


def refined(scans: Scans, enactments: Sequence[Enactment]) -> list[Enactment]:
    """Return re-enactments with their hypotheses refined on all voxels and weighed by the fit there, the best first."""
    T_k = scans.refined(np.stack([enactment.hypothesis.T for enactment in enactments]))
    better = [
        replace(enactment, hypothesis=replace(enactment.hypothesis, T=T, log_posterior=-INDEPENDENT * scans.misfit(T)))
        for enactment, T in zip(enactments, T_k, strict=True)
    ]
    return sorted(better, key=lambda enactment: -enactment.hypothesis.log_posterior)


def failure_of(scans: Scans, enactments: Sequence[Enactment], T_found: np.ndarray) -> float:
    """Return the probability that the pose is off by more than the limit.

    Args:
        enactments: of the :func:`refined` poses; errors are over the surface that is common at each.
    """
    found = scans.outcome(T_found)
    if not found.fitness > 0:
        return 1.0
    error_k = np.array([0.0, *(_distance(enactment, T_found) for enactment in enactments)])
    posteriors = (enactment.hypothesis.log_posterior for enactment in enactments)
    posterior_k = np.array([-INDEPENDENT * scans.misfit(T_found), *posteriors])
    weight_k = np.exp(posterior_k - posterior_k.max())
    by_poses = (weight_k * expit(STEEPNESS * np.log(np.maximum(error_k, LEAST) / LIMIT))).sum() / weight_k.sum()
    by_fit = expit(CLOSE_STEEPNESS * np.log(max(found.inlier_rmse / scans.voxel, LEAST) / CLOSE))
    return float(by_poses + by_fit) / 2


def state_of(failure: float, overlap: float) -> str:
    """Return the state, by the probability of a failure and the share of the source that lies on the target."""
    if failure >= BAD:
        return FAILED
    return NOMINAL if failure < GOOD and overlap >= LEAST_OVERLAP else NOT_SURE


def decision(state: str, reenacted: Reenacted, overlap: float) -> tuple[str, str]:
    """Return what to do next, and why."""
    if state == NOMINAL:
        return NOTHING, "the scans lie close to each other, and no other pose fits as well"
    if overlap == 0:
        return TREATMENTS["pose"], "no point of the source lies on the target: give an initial pose or a global method"
    if not reenacted.poses[0].registered:
        return TREATMENTS["pose"], "another pose may be right: start from pose 1"
    if overlap < LEAST_OVERLAP:
        return TREATMENTS["overlap"], f"only {overlap:.0%} of the source lies on the target"
    if state == NOT_SURE:
        return CHECK, "another pose fits nearly as well, or the scans do not lie close to each other"
    cause = max(reenacted.effects, key=lambda name: reenacted.effects[name])
    return TREATMENTS[cause], f"{cause} adds most to the re-enacted error"


def warnings_of(overlap: float) -> tuple[str, ...]:
    """Return reasons to doubt the verdict."""
    if overlap >= LEAST_OVERLAP:
        return ()
    return (f"only {overlap:.0%} of the source lies on the target: wrong poses may fit as well as the right one",)


def _distance(enactment: Enactment, T_found: np.ndarray) -> float:
    candidate, T = enactment.candidate, enactment.hypothesis.T
    # The candidate lies where the hypothesis was before it was refined.
    common = transform(T @ candidate.T_init, candidate.noisy[candidate.seen])
    return float(displacements((T_found @ inverse(T))[None], common)[0])
