"""The search of the re-enactment as a registration method: EM from many starts, with or without the initial pose."""

from functools import partial
from typing import Annotated

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.icp import ICPSettings
from gpca.alignment.methods.interface import FEWEST, ITERATIONS, REACH, FailedRegistration, MethodEntry, Outcome, Pair
from gpca.alignment.methods.local import align_compiled
from gpca.reenactment.hypotheses import (
    LAST_ITERATIONS,
    find_hypotheses,
    first_of_alike,
    log_prior,
    rotations,
    search_starts,
    weights_of,
)
from gpca.reenactment.mixture import Mixture
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import inverse, rigid_motion, scale_translation, transform
from gpca.seeds import generator
from gpca.settings import Bounds, Positive, PositiveShare

JUDGED = 24  # ends of the least cost, whose likelihoods are compared
TURNS = 96  # starts at turns of any size, where there is no initial pose


class Frame:
    """The frame of a search, at the center of the target and in `unit`: source, at its initial pose, and target."""

    def __init__(self, pair: Pair, T_init: np.ndarray, unit: float) -> None:
        T_frame_target = rigid_motion(np.eye(3), -pair.target.mean(axis=0))
        self._T_frame_source, self._T_target_frame, self._unit = T_frame_target @ T_init, inverse(T_frame_target), unit
        self.source = transform(self._T_frame_source, pair.source) / unit
        self.target = transform(T_frame_target, pair.target) / unit
        if min(len(np.unique(points, axis=0)) for points in (self.source, self.target)) < FEWEST:
            raise FailedRegistration(f"fewer than {FEWEST} different points")

    def pose(self, T: np.ndarray) -> np.ndarray:
        """Return the pose T_target_source (4×4) of a motion of the source in this frame."""
        return self._T_target_frame @ scale_translation(T, self._unit) @ self._T_frame_source


def pose_posterior(
    pair: Pair, settings: ReenactmentSettings, prior: bool = True, unit: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return probable poses T_target_source (K, 4, 4), the best first, and their probabilities (K,), for a target of
    the diameter `unit`; without a prior, the initial pose is not read."""
    onto_center = rigid_motion(np.eye(3), pair.target.mean(axis=0) - pair.source.mean(axis=0))
    frame = Frame(pair, pair.T_target_source_init if prior else onto_center, unit)
    random = generator("registration", "posterior", pair.seed)
    found_n, evidence = np.empty((0, 4, 4)), None
    if not prior:
        found_n, evidence = rigid_motion(rotations(TURNS, 180.0)), lambda T, _width: -log_prior(T, settings)
    hypotheses = find_hypotheses(frame.source, ModelSurface(frame.target), found_n, settings, random, evidence)
    return np.stack([frame.pose(hypothesis.T) for hypothesis in hypotheses]), weights_of(hypotheses)


def align(prior: bool, pair: Pair, correspondence_distance: float = REACH, unit: Positive = 1.0) -> Outcome:
    """Return the likeliest pose; `unit` is taken for the diameter of the target."""
    (T, *_), _ = pose_posterior(pair, ReenactmentSettings(), prior, unit)
    return Outcome.at(pair, T, correspondence_distance)


def align_from_many(
    by_likelihood: bool,
    pair: Pair,
    wide_distance: Positive = 0.25,
    correspondence_distance: float = REACH,
    max_iterations: int = ITERATIONS,
    overlap: PositiveShare = 0.9,
    points: Annotated[int, Bounds(minimum=FEWEST)] = 512,
    unit: Positive = 1.0,
) -> Outcome:
    """Run ICP from the starts of the search on `points` of the source; refine the end of the least trimmed cost.

    The cost is over the share `overlap` of all distances; by likelihood, the best ends are compared by the mixture.
    """
    frame = Frame(pair, pair.T_target_source_init, unit)
    kept = generator("registration", "many starts", pair.seed).permutation(len(frame.source))[:points]
    few, ends_n = frame.source[np.sort(kept)], search_starts(frame.source, frame.target)
    for distance in (wide_distance, correspondence_distance):
        icp = BatchedICP(frame.target, ICPSettings("point_to_point", distance / unit, max_iterations))
        ends_n = icp.register(few, ends_n)[0]
        ends_n = ends_n[first_of_alike(ends_n)]
    tree, counted = cKDTree(frame.target), max(FEWEST, round(overlap * len(few)))
    distance_n_N = np.sort([tree.query(transform(T, few))[0] for T in ends_n], axis=1)
    order_n = np.argsort(np.square(distance_n_N[:, :counted]).mean(axis=1), kind="stable")
    if by_likelihood:
        order_n = order_n[:JUDGED]
        mixture = Mixture(frame.target, ModelSurface(frame.target).spacing / 2)
        fits = mixture.fit(few, ends_n[order_n], LAST_ITERATIONS, moving=False)
        order_n = order_n[np.argsort(-fits.log_likelihood_n, kind="stable")]
    best = frame.pose(ends_n[order_n[0]])
    return align_compiled(pair.started_at(best), correspondence_distance, max_iterations)


METHODS = {
    "posterior": MethodEntry("EM from many starts, initial pose as prior", partial(align, True), points_only=True),
    "posterior_global": MethodEntry("EM from many starts", partial(align, False), is_global=True, points_only=True),
    "multistart": MethodEntry(
        "ICP from many starts, least trimmed cost", partial(align_from_many, False), points_only=True
    ),
    "multistart_likelihood": MethodEntry(
        "ICP from many starts, likeliest end", partial(align_from_many, True), points_only=True
    ),
}
