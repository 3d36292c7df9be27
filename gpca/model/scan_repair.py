"""Puts the registration of two scans right, in the words of objects, and promises nothing."""

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from gpca.model.diagnosis import CHECK, UNKNOWN, outside
from gpca.model.explanation import LEARNED
from gpca.model.repair import verdict_of
from gpca.model.repaired import OtherPose, Repair
from gpca.model.scan_explainer import (
    GOOD,
    LEAST_OVERLAP,
    SHOWN_REACH,
    evidence_at,
    failure_of,
    registered_scans,
    weights_and_errors,
)
from gpca.model.scene import Scene


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
        more = {"off": float(failed), "differs": None, "differs_by": 0.0}
        poses.append(outside(OtherPose.of(pose, weight, expected, T, scans.coarse, **more), frame, T_init))
    at_pose, T_registered = scans.outcome(T_n[verdict.row]), frame.pose_outside(T) @ T_init
    repair = Repair(
        T_target_source=T_registered,
        T_registered=T_registered,
        fitness=at_pose.fitness,
        inlier_rmse=at_pose.inlier_rmse * frame.diameter,
        method=method,
        verdict=UNKNOWN,
        action=CHECK,
        reason="",
        unit=unit,
        tolerance=limit,
        tolerance_share=tolerance,
        notes=tuple(notes),
        learned_from=LEARNED,
        scene=Scene(scans.source, scans.target, T, frame, SHOWN_REACH * scans.voxel, tolerance),
    ).decided(verdict, poses, T_n, GOOD, GOOD)
    return replace(repair, seconds=perf_counter() - started)
