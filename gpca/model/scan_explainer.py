"""Explains the registration of two scans of any size without a model, as docs/real_world.md has it."""

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from scipy.special import expit

from gpca.alignment.methods.interface import Outcome
from gpca.alignment.pose_error import displacements
from gpca.causes.policy import NOTHING, TREATMENTS
from gpca.causes.truth import FAILED, NOMINAL
from gpca.errors import InputError
from gpca.model.diagnosis import CHECK, RERUN, RESCALE, Reenacted, outside
from gpca.model.explanation import GIVEN, LEARNED, NOT_SURE, Evidence, Motion, PoseSpread, ScanExplanation
from gpca.model.repair import verdict_of
from gpca.model.repaired import OtherPose, Repair
from gpca.model.scan_registration import TRUTH, PossiblePose, Scans, in_voxels, voxel_size
from gpca.model.scene import Scene
from gpca.numerals import in_decimals
from gpca.objects.canonical import CanonicalFrame, diameter, require_cloud_points
from gpca.objects.surface import as_points, in_unit, meters_per
from gpca.reenactment.enactment import Enactment
from gpca.reenactment.hypotheses import weights_of
from gpca.reenactment.settings import STEEPNESS
from gpca.rigid import inverse, require_rigid, transform

OUTSIDE = 0.01  # share of the target's points on either side that its extent ignores
FEWEST_VOXELS = 64
SHOWN_REACH = 5.0  # voxels, up to which distances are colored
# The default limit of an error: at least that of rooms and of what voxels resolve, at most a share of the extent.
LIMIT_M, LIMIT_VOXELS, LIMIT_SHARE = 0.2, 2.0, 0.05
# Of the log odds of a failure, by `benchmarks/scan_judgment.py`: of what is elsewhere, of log(apart), and the constant.
OF_ELSEWHERE, OF_LOG_APART, LOG_ODDS = 8.0, 3.5, -2.3
GOOD, BAD = 0.2, 0.5  # probability of a failure below which the state is nominal, and from which it is failed
LEAST_OVERLAP = 0.2  # share of the source below which a wrong pose fits as well as the right one
VOLUME = "the points of a scan fill a volume, as noise does, instead of lying on surfaces: any pose fits"
OWN_ERROR = 0.3  # voxels, of a pose that fits
LEAST = 1e-6  # lower bound of arguments of logarithms
ADDS = 1 / 3  # of the limit, that a cause adds at least to the error: as in the diagnosis of objects


def explain_scans(
    source_points: Any,
    target_points: Any,
    T_target_source_init: np.ndarray | None = None,
    unit: str = "m",
    voxel: float | None = None,
    method: str | None = None,
    source_unit: str | None = None,
    limit: float | None = None,
    T_target_source: np.ndarray | None = None,
    estimator: str | None = None,
) -> ScanExplanation:
    """Register a scan to a scan, and judge whether that may have failed. The same clouds give the same numbers.

    Both, arrays (N, 3) or Open3D clouds, are thinned to voxels of this edge, by default by the point spacing. Methods
    and estimators are those of docs/registration.md. A result is wrong if its error, root mean square over the common
    surface, is above the limit: by default, 0.2 m or two voxels, but at most 5 % of the target's extent. If
    `T_target_source` is given, it is judged, and nothing is registered.
    """
    started = perf_counter()
    given = source_points, target_points, T_target_source_init, unit, voxel, method, source_unit, limit, T_target_source
    scans, frame, T_init, outcome, name, limit, notes = registered_scans(*given)
    T_found, tolerance = outcome.T_target_source, limit / frame.diameter
    ranked = scans.poses(T_found, min(scans.voxel, tolerance / 2))
    enactments = [scans.enacted(pose, T_found) for pose in ranked]
    reenacted = outside(_reenacted(scans, enactments, T_found), frame, T_init)
    evidence, overlap = evidence_at(scans, ranked, T_found, tolerance), scans.overlap(T_found)
    failure = failure_of(evidence)
    state = state_of(failure, overlap[0])
    if scans.fills_volume and state == NOMINAL:
        state = NOT_SURE
    effects = {} if state == NOMINAL else reenacted.effects
    by_effect = sorted(effects, key=lambda name: -effects[name])
    causes = tuple(name for name in by_effect if effects[name] >= ADDS * limit)
    action, reason = decision(state, reenacted, overlap[0], causes)
    if (scale := reenacted.scale) and scale.off and scale.error > limit:
        state, causes, action, reason = FAILED, ("scale",), RESCALE, scale.advice
    little = f"only {overlap[0]:.0%} of the source lies on the target: wrong poses may fit as well as the right one"
    warnings = [little] if overlap[0] < LEAST_OVERLAP else []
    warnings += [VOLUME] if scans.fills_volume else []
    moved, spread = None, None
    if T_target_source is None and T_target_source_init is not None:
        moved = Motion.of(T_found, scans.source, frame.diameter)
    if estimator is not None:
        by = method or ("point_to_point" if scans.flat else "point_to_plane")
        estimated = scans.estimated(estimator, outcome, by)
        if estimated.covariance_6_6 is None:
            notes.append(f"{estimator} gives no covariance: {estimated.failure}")
        else:
            spread = PoseSpread(estimated.covariance_6_6, frame.diameter, estimator, None)
    return ScanExplanation(
        T_target_source=frame.pose_outside(T_found) @ T_init,
        fitness=outcome.fitness,
        inlier_rmse=outcome.inlier_rmse * frame.diameter,
        method=name,
        voxel=scans.voxel * frame.diameter,
        state=state,
        failure=failure,
        evidence=evidence,
        limit=limit,
        overlap=overlap,
        causes=causes,
        reenacted=reenacted,
        spread=spread,
        moved=moved,
        action=action,
        reason=reason,
        unit=unit,
        seconds=perf_counter() - started,
        notes=tuple(notes),
        warnings=tuple(warnings),
        scene=Scene(
            *(scans.source, scans.target, T_found, frame, SHOWN_REACH * scans.voxel, tolerance),
            enactments=enactments,
            truth=TRUTH,
        ),
    )


def repair_scans(
    source_points: Any,
    target_points: Any,
    T_target_source_init: np.ndarray | None = None,
    unit: str = "m",
    **options: Any,
) -> Repair:
    """Register as :func:`explain_scans` does, and put a wrong result right where another pose is nominal."""
    started = perf_counter()
    scans, frame, T_init, outcome, method, limit, notes = registered_scans(
        source_points, target_points, T_target_source_init, unit, **options
    )
    T, tolerance = outcome.T_target_source, limit / frame.diameter
    ranked = scans.poses(T, min(scans.voxel, tolerance / 2))
    weight_k, _ = weights_and_errors(scans, ranked, T)
    others = [(pose.T, float(weight)) for pose, weight in zip(ranked, weight_k, strict=True) if pose.T is not T]
    T_n, weight_n = [T, *(pose for pose, _ in others)], np.array([0.0, *(weight for _, weight in others)])

    def failure(rows: list[int]) -> float:
        first, *also = (T_n[row] for row in rows)
        failed = failure_of(evidence_at(scans, ranked, first, tolerance, *also))
        return failed if scans.overlap(first)[0] >= LEAST_OVERLAP else max(failed, GOOD)

    failure_n = np.array([failure([row]) for row in range(len(T_n))])
    verdict = verdict_of(failure_n, weight_n, GOOD, GOOD, failure)
    poses = []
    for (pose, weight), failed in zip(others, failure_n[1:], strict=True):
        expected = float((weight_k * weights_and_errors(scans, ranked, pose)[1]).sum())
        other = OtherPose.of(pose, weight, expected, T, scans.coarse, off=float(failed))
        poses.append(outside(other, frame, T_init))
    at_pose, T_registered = scans.outcome(T_n[verdict.row]), frame.pose_outside(T) @ T_init
    repair = Repair(
        T_target_source=T_registered,
        T_registered=T_registered,
        fitness=at_pose.fitness,
        inlier_rmse=at_pose.inlier_rmse * frame.diameter,
        method=method,
        unit=unit,
        tolerance=limit,
        tolerance_share=tolerance,
        notes=tuple(notes),
        learned_from=LEARNED,
        scene=Scene(scans.source, scans.target, T, frame, SHOWN_REACH * scans.voxel, tolerance),
    ).decided(verdict, poses, T_n, GOOD, GOOD)
    return replace(repair, seconds=perf_counter() - started)


def registered_scans(
    source_points: Any,
    target_points: Any,
    T_target_source_init: np.ndarray | None,
    unit: str,
    voxel: float | None = None,
    method: str | None = None,
    source_unit: str | None = None,
    limit: float | None = None,
    T_target_source: np.ndarray | None = None,
) -> tuple[Scans, CanonicalFrame, np.ndarray, Outcome, str, float, list[str]]:
    """Return thinned scans, the target's frame, the initial pose, the registration, its method and limit, and notes."""
    T_given = None if T_target_source is None else np.array(T_target_source, np.float64)
    T_init = T_target_source_init if T_target_source_init is not None or T_given is None else T_given
    T_init = np.eye(4) if T_init is None else np.array(T_init, np.float64)
    require_rigid(T_init, "initial pose")
    notes: list[str] = []
    source = in_unit(as_points(source_points, "source", notes), source_unit, unit)
    clouds = {"source": source, "target": as_points(target_points, "target", notes)}
    scans, frame = _prepared(clouds, T_init, unit, voxel, notes)
    if limit is None:
        most = max(LIMIT_M / meters_per(unit), LIMIT_VOXELS * scans.voxel * frame.diameter)
        limit = min(most, LIMIT_SHARE * frame.diameter)
    if not 0 < limit < np.inf:
        raise InputError("limit", f"{limit:g} is no length", "give a positive one")
    if T_given is not None:
        require_rigid(T_given, "pose")
        outcome = scans.outcome(frame.pose_inside(T_given @ inverse(T_init)))
    else:
        outcome = scans.registered(method)
    if outcome.failure:
        notes.append(f"{method} failed: {outcome.failure}")
    icp = f"{'point_to_point' if scans.flat else 'point_to_plane'}, coarse to fine or fine"
    return scans, frame, T_init, outcome, GIVEN if T_given is not None else method or icp, limit, notes


def _reenacted(scans: Scans, enactments: Sequence[Enactment], T_found: np.ndarray) -> Reenacted:
    weight_k = weights_of(enactment.hypothesis for enactment in enactments)
    reenacted = Reenacted.of(enactments, weight_k, T_found, scans.coarse)
    poses = (replace(pose, registered=pose.T_target_source is T_found) for pose in reenacted.poses)
    return replace(reenacted, poses=tuple(poses)).with_fit(scans.few, T_found, scans.coarse, open_ends=True)


def _prepared(
    clouds: dict[str, np.ndarray], T_init: np.ndarray, unit: str, voxel: float | None, notes: list[str]
) -> tuple[Scans, CanonicalFrame]:
    meters_per(unit)
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
    scans = Scans(source, frame.coordinates(clouds["target"]), voxel / frame.diameter)
    if scans.flat:
        notes.append("the scans are flat: point-to-plane cannot move them, so they are registered point-to-point")
    return scans, frame


def weights_and_errors(
    scans: Scans, poses: Sequence[PossiblePose], *T_results: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the probabilities (k,) of poses that may be true, and then the error of the nearest result."""
    weight_k = np.exp([pose.log_posterior - max(each.log_posterior for each in poses) for pose in poses])
    T_n = np.array(T_results)
    error_k = [displacements(T_n @ inverse(pose.T), scans.common(pose.T)).min() for pose in poses]
    return weight_k / weight_k.sum(), np.array(error_k)


def evidence_at(
    scans: Scans, poses: Sequence[PossiblePose], T_found: np.ndarray, limit: float, *T_also: np.ndarray
) -> Evidence:
    """Gather what speaks for a failure of a result, and of further poses, with a limit in units of the extent."""
    at_result = scans.outcome(T_found)
    weight_k, error_k = weights_and_errors(scans, poses, T_found, *T_also)
    log_error_k = np.log(np.hypot(error_k, OWN_ERROR * scans.voxel) / limit)
    elsewhere = (weight_k * expit(STEEPNESS * log_error_k)).sum()
    return Evidence(float(elsewhere), at_result.inlier_rmse / scans.voxel, at_result.fitness)


def failure_of(evidence: Evidence) -> float:
    if not evidence.overlap > 0:
        return 1.0
    log_apart = np.log(max(evidence.apart, LEAST))
    return float(expit(OF_ELSEWHERE * evidence.elsewhere + OF_LOG_APART * log_apart + LOG_ODDS))


def state_of(failure: float, overlap: float) -> str:
    """Return the state: where little lies on the target, a wrong pose fits as well as the right one."""
    if 0 < overlap < LEAST_OVERLAP:
        return NOT_SURE
    return FAILED if failure >= BAD else NOMINAL if failure < GOOD else NOT_SURE


def decision(state: str, reenacted: Reenacted, overlap: float, causes: Sequence[str]) -> tuple[str, str]:
    if state == NOMINAL:
        return NOTHING, "the scans lie close to each other, and no other pose fits as well"
    if overlap == 0:
        return TREATMENTS["pose"], "no point of the source lies on the target: give an initial pose or a global method"
    if causes and causes[0] == "overlap":
        return TREATMENTS["overlap"], "on their common parts alone, the scans would have been registered better"
    if not reenacted.poses[0].registered:
        return RERUN, "pose 1 fits better"
    if overlap < LEAST_OVERLAP:
        return TREATMENTS["overlap"], f"only {overlap:.0%} of the source lies on the target"
    if state == NOT_SURE or not causes:
        return CHECK, "another pose fits nearly as well, or the scans do not lie close to each other"
    return TREATMENTS[causes[0]], f"{causes[0]} adds most to the re-enacted error"
