"""Explains the registration of a scan to a scan of a user's own, of any size, without any training.

Both clouds are partial, so the classifiers that learned from whole objects are not asked. What is left needs no
training: which poses fit the two scans, how far the result lies from them, how much the scans overlap there, and what
the registration would have done with a right start, with the common parts alone, or with smoothed points.
"""

from __future__ import annotations

from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from gpca.alignment.canonical_frame import CanonicalFrame, require_cloud_points
from gpca.alignment.rigid import require_rigid, transform
from gpca.causes.settings import OBSERVED, CauseSettings
from gpca.errors import InputError
from gpca.features.pair import ObservedPair
from gpca.model.reenacted import Reenacted
from gpca.model.scan_explanation import ScanExplanation
from gpca.model.scan_registration import Scans
from gpca.model.scan_verdict import LIMIT, decision, failure_of, refined, state_of, warnings_of
from gpca.model.scene import Scene
from gpca.model.voxels import in_voxels, require_edge, voxel_size
from gpca.objects.canonical import diameter
from gpca.objects.mesh_folder import meters_per
from gpca.objects.surface import as_points
from gpca.reenactment.enactment import Enactment
from gpca.reenactment.hypotheses import weights_of
from gpca.reenactment.scan_enactment import reenact_scan
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface

OUTSIDE = 0.01  # of the target's points on either side do not count for its extent: a few may be far away
FEWEST_VOXELS = 64
ICP = "point_to_plane, coarse to fine"
SHOWN_REACH = 5.0  # voxels, up to which distances are colored


def explain_scans(
    source_points: Any,
    target_points: Any,
    T_target_source_init: np.ndarray | None = None,
    unit: str = "m",
    voxel: float | None = None,
    method: str | None = None,
) -> ScanExplanation:
    """Register a scan to a scan, and say whether that may have failed. The same clouds give the same numbers.

    Args:
        source_points, target_points: (N, 3) arrays, or clouds of Open3D, of any extent.
        T_target_source_init: (4, 4) where the registration starts; the identity by default.
        unit: that of points, pose and voxel: ``m``, ``cm`` or ``mm``.
        voxel: edge of the voxels that both are thinned to; chosen by their spacing by default.
        method: registration method (docs/registration.md); by default point-to-plane ICP, coarse to fine.

    Raises:
        InputError: too few points, NaN, points on one line, an initial pose that is no rigid transform, voxels that
            leave too few points, an unknown method or one whose package is missing.
    """
    started = perf_counter()
    meters_per(unit)
    T_init = np.eye(4) if T_target_source_init is None else np.array(T_target_source_init, np.float64)
    require_rigid(T_init, "initial pose")
    scans, frame, notes = _prepared(
        as_points(source_points, "source"), as_points(target_points, "target"), T_init, unit, voxel
    )
    outcome = scans.registered() if method is None else scans.registered_by(method)
    if outcome.failure:
        notes.append(f"{method} failed: {outcome.failure}")
    T_found = outcome.T_target_source
    pair = scans.pair(T_found)
    enact = partial(_enacted, scans, pair)
    enactments, _ = enact()
    weight_k = weights_of(enactment.hypothesis for enactment in enactments)
    failure, overlap = failure_of(scans, enactments, T_found), scans.overlap(T_found)
    reenacted = Reenacted.of(enactments, weight_k, T_found, ModelSurface(pair.model)).outside(frame, T_init)
    state = state_of(failure, overlap[0])
    action, reason = decision(state, reenacted, overlap[0])
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
        warnings=warnings_of(overlap[0]),
        scene=Scene(scans.source, scans.target, T_found, frame, SHOWN_REACH * scans.voxel, LIMIT, enact),
    )


def _prepared(
    source: np.ndarray, target: np.ndarray, T_init: np.ndarray, unit: str, voxel: float | None
) -> tuple[Scans, CanonicalFrame, list[str]]:
    """Return the scans in voxels, the frame of the target, and what was done to them."""
    clouds = {"source": source, "target": target}
    for name, points in clouds.items():
        require_cloud_points(points, name)
    if voxel is None:
        voxel = voxel_size(clouds, unit)
    require_edge(voxel, "voxel")
    notes = []
    for name, points in clouds.items():
        thinned = clouds[name] = in_voxels(points, voxel, name, unit)
        notes.append(f"{name}: {len(thinned)} of {len(points)} points, means over voxels of {voxel:.3g} {unit}")
        if len(thinned) < FEWEST_VOXELS:
            remedy = f"give both in one unit, and voxels so small that it fills {FEWEST_VOXELS}"
            raise InputError(name, f"fills {len(thinned)} voxels of {voxel:.3g} {unit}", remedy)
        diameter(thinned, name)  # which a line does not have
    low, high = np.quantile(clouds["target"], (OUTSIDE, 1 - OUTSIDE), axis=0)
    frame = CanonicalFrame((low + high) / 2, float(np.sqrt(np.square(high - low).sum())))
    began = frame.coordinates(transform(T_init, clouds["source"]))
    return Scans(began, frame.coordinates(clouds["target"]), voxel / frame.diameter), frame, notes


def _enacted(scans: Scans, pair: ObservedPair) -> tuple[list[Enactment], CauseSettings]:
    """Return the re-enactments of a pair, whose errors are distances, and how they were registered."""
    truth = CauseSettings(moved=OBSERVED)
    return refined(scans, reenact_scan(pair, 1.0, ReenactmentSettings(), truth)), truth
