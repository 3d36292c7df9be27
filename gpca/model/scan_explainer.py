"""Explains the registration of two scans of any size without training.

Both clouds are partial, so classifiers trained on whole objects do not apply. The probability of a failure is the mean
of two. The first compares the result with the hypotheses of the true pose, each refined on all voxels and weighted by
its fit. The second is the distance between partners at the result: two samples of one surface, one point per voxel, lie
about 0.6 voxels apart; surfaces that only cross, about 1.1. The mean ranked failures better than either on the
development scenes of 3DMatch, on which the constants were chosen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from scipy.special import expit

from gpca.alignment.pose_error import displacements
from gpca.causes.policy import NOTHING, TREATMENTS
from gpca.causes.settings import OBSERVED, CauseSettings
from gpca.causes.truth import FAILED, NOMINAL
from gpca.errors import InputError
from gpca.model.diagnosis import CHECK, Reenacted
from gpca.model.explanation import NOT_SURE, ScanExplanation
from gpca.model.scan_registration import Scans, in_voxels, voxel_size
from gpca.model.scene import Scene
from gpca.numerals import in_decimals
from gpca.objects.canonical import CanonicalFrame, diameter, require_cloud_points
from gpca.objects.surface import as_points, in_unit, meters_per
from gpca.pairs.distances import ObservedPair
from gpca.reenactment.enactment import Enactment
from gpca.reenactment.hypotheses import INDEPENDENT, weights_of
from gpca.reenactment.scans import reenact_scan
from gpca.reenactment.settings import STEEPNESS, ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import inverse, require_rigid, transform

OUTSIDE = 0.01  # share of the target's points on either side that its extent ignores
FEWEST_VOXELS = 64
ICP = "point_to_plane, coarse to fine"
SHOWN_REACH = 5.0  # voxels, up to which distances are colored
LIMIT = 0.05  # error above which a registration has failed, in extents of the target: 0.2 m of 4 m, as in rooms
CLOSE = 0.8  # distance between partners with an even chance of failure, root mean square, voxels
CLOSE_STEEPNESS = 16.0  # of the probability in the logarithm of this distance
GOOD, BAD = 0.2, 0.5  # probability of a failure below which the state is nominal, and from which it is failed
LEAST_OVERLAP = 0.2  # share of the source below which a wrong pose fits as well as the right one
TRUTH = CauseSettings(moved=OBSERVED)  # of re-enactments
LEAST = 1e-6  # lower bound of arguments of logarithms


def explain_scans(
    source_points: Any,
    target_points: Any,
    T_target_source_init: np.ndarray | None = None,
    unit: str = "m",
    voxel: float | None = None,
    method: str | None = None,
    source_unit: str | None = None,
) -> ScanExplanation:
    """Register a scan to a scan, and judge whether that may have failed. The same clouds give the same numbers.

    Args:
        source_points, target_points: (N, 3) arrays, or Open3D clouds, of any extent.
        T_target_source_init: (4, 4) initial pose; by default, the identity.
        unit: unit of points, pose, voxel and results: ``m``, ``cm`` or ``mm``.
        voxel: edge length of the voxels to which both are thinned; by default, chosen from the point spacing.
        method: registration method (docs/registration.md); by default, point-to-plane ICP, coarse to fine.
        source_unit: unit of the source's points, if another one; they are converted first.

    Raises:
        InputError: too few points with a measurement, points on one line, an initial pose that is not rigid, voxels
            that leave too few points, unknown method or missing package.
    """
    started = perf_counter()
    meters_per(unit)
    T_init = np.eye(4) if T_target_source_init is None else np.array(T_target_source_init, np.float64)
    require_rigid(T_init, "initial pose")
    notes: list[str] = []
    source = in_unit(as_points(source_points, "source", notes), source_unit, unit)
    clouds = {"source": source, "target": as_points(target_points, "target", notes)}
    scans, frame = _prepared(clouds, T_init, unit, voxel, notes)
    outcome = scans.registered() if method is None else scans.registered_by(method)
    if outcome.failure:
        notes.append(f"{method} failed: {outcome.failure}")
    T_found = outcome.T_target_source
    pair = scans.pair(T_found)
    enactments = _enacted(scans, pair)
    weight_k = weights_of(enactment.hypothesis for enactment in enactments)
    reenacted = Reenacted.of(enactments, weight_k, T_found, ModelSurface(pair.model)).outside(frame, T_init)
    failure, overlap = failure_of(scans, enactments, T_found), scans.overlap(T_found)
    fine = failure < GOOD and overlap[0] >= LEAST_OVERLAP
    state = FAILED if failure >= BAD else NOMINAL if fine else NOT_SURE
    action, reason = decision(state, reenacted, overlap[0])
    warning = f"only {overlap[0]:.0%} of the source lies on the target: wrong poses may fit as well as the right one"
    return ScanExplanation(
        T_target_source=frame.pose_outside(T_found) @ T_init,
        fitness=outcome.fitness,
        inlier_rmse=outcome.inlier_rmse * frame.diameter,
        method=method or ICP,
        voxel=scans.voxel * frame.diameter,
        state=state,
        failure=failure,
        limit=LIMIT * frame.diameter,
        overlap=overlap,
        reenacted=reenacted,
        action=action,
        reason=reason,
        unit=unit,
        seconds=perf_counter() - started,
        notes=tuple(notes),
        warnings=(warning,) if overlap[0] < LEAST_OVERLAP else (),
        scene=Scene(
            *(scans.source, scans.target, T_found, frame, SHOWN_REACH * scans.voxel, LIMIT),
            enactments=enactments,
            truth=TRUTH,
        ),
    )


def _prepared(
    clouds: dict[str, np.ndarray], T_init: np.ndarray, unit: str, voxel: float | None, notes: list[str]
) -> tuple[Scans, CanonicalFrame]:
    """Thin both scans to voxels; return them with the frame of the target."""
    for name, points in clouds.items():
        require_cloud_points(points, name)
    if voxel is None:
        voxel = voxel_size(clouds, unit)
    if not 0 < voxel < np.inf:
        raise InputError("voxel", f"{voxel:g} is no length", "give a positive one")
    for name, points in clouds.items():
        thinned = clouds[name] = in_voxels(points, voxel, name, unit)
        edge = f"{in_decimals(voxel, 3)} {unit}"
        notes.append(f"{name}: {len(thinned)} of {len(points)} points, means over voxels of {edge}")
        if len(thinned) < FEWEST_VOXELS:
            remedy = f"give both in one unit, and voxels so small that it fills {FEWEST_VOXELS}"
            raise InputError(name, f"fills {len(thinned)} voxels of {edge}", remedy)
        diameter(thinned, name)  # raises an InputError for points on one line
    low, high = np.quantile(clouds["target"], (OUTSIDE, 1 - OUTSIDE), axis=0)
    frame = CanonicalFrame((low + high) / 2, float(np.sqrt(np.square(high - low).sum())))
    source = frame.coordinates(transform(T_init, clouds["source"]))
    return Scans(source, frame.coordinates(clouds["target"]), voxel / frame.diameter), frame


def _enacted(scans: Scans, pair: ObservedPair) -> list[Enactment]:
    """Re-enact a pair, with hypotheses refined on all voxels and weighted by their fit, the best first."""
    enactments = reenact_scan(pair, 1.0, ReenactmentSettings(), TRUTH)
    T_k = scans.refined(np.stack([enactment.hypothesis.T for enactment in enactments]))
    refined = [
        replace(enactment, hypothesis=replace(enactment.hypothesis, T=T, log_posterior=-INDEPENDENT * scans.misfit(T)))
        for enactment, T in zip(enactments, T_k, strict=True)
    ]
    return sorted(refined, key=lambda enactment: -enactment.hypothesis.log_posterior)


def failure_of(scans: Scans, enactments: Sequence[Enactment], T_found: np.ndarray) -> float:
    """Return the probability of an error above the limit, over the surface that is common at each hypothesis."""
    at_result = scans.outcome(T_found)
    if not at_result.fitness > 0:
        return 1.0
    errors = [0.0]
    for enactment in enactments:
        candidate, T = enactment.candidate, enactment.hypothesis.T
        # The candidate lies where the hypothesis was before its refinement.
        common = transform(T @ candidate.T_init, candidate.noisy[candidate.seen])
        errors.append(float(displacements((T_found @ inverse(T))[None], common)[0]))
    posteriors = (enactment.hypothesis.log_posterior for enactment in enactments)
    posterior_k = np.array([-INDEPENDENT * scans.misfit(T_found), *posteriors])
    weight_k = np.exp(posterior_k - posterior_k.max())
    log_error_k = np.log(np.maximum(np.array(errors), LEAST) / LIMIT)
    by_poses = (weight_k * expit(STEEPNESS * log_error_k)).sum() / weight_k.sum()
    by_fit = expit(CLOSE_STEEPNESS * np.log(max(at_result.inlier_rmse / scans.voxel, LEAST) / CLOSE))
    return float(by_poses + by_fit) / 2


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
