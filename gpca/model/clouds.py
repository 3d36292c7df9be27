"""The two clouds of a registration of a user's own: checked, thinned, and in the target's canonical frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.canonical_frame import CanonicalFrame, require_cloud_points, thin
from gpca.alignment.icp import ICPSettings
from gpca.alignment.rigid import require_rigid, transform
from gpca.errors import InputError
from gpca.objects.canonical import normals_towards_camera
from gpca.objects.surface import AS_ARGUMENT, as_points

LARGEST_RATIO = 8.0  # the extents of source and target may differ so much; in the wrong unit they differ by 10 or more
# Diameters of the target between its center and the source: farther off, nothing can meet, and the unit may be wrong.
FARTHEST_START = 10.0
OR_SCANS = f"{AS_ARGUMENT} (scans of places: gpca.explain_scans)"


@dataclass(frozen=True)
class Clouds:
    """The clouds that are registered, and ICP between them.

    Attributes:
        seen: (N, 3) the source as it was given, thinned.
        T_target_source_init: where ICP starts, in the user's unit.
        frame: that of the target.
        source, target: (N, 3) and (P, 3) in that frame, the source at its initial pose.
        icp: runs from there.
    """

    seen: np.ndarray
    T_target_source_init: np.ndarray
    frame: CanonicalFrame
    source: np.ndarray
    target: np.ndarray
    icp: BatchedICP

    @classmethod
    def prepared(
        cls,
        source_points: np.ndarray,
        target_points: np.ndarray,
        T_target_source_init: np.ndarray | None,
        unit: str,
        frame: CanonicalFrame | None,
        cloud_points: int,
        settings: ICPSettings,
        notes: list[str],
    ) -> Clouds:
        """Check a user's clouds and bring them into the target's frame.

        Args:
            source_points, target_points, T_target_source_init, unit, frame: as of
                :meth:`gpca.model.explainer.Explainer.explain`.
            cloud_points: of each cloud, at most; a note says where points are left out.
            settings: of ICP.
            notes: list to which remarks for the user are added.

        Raises:
            InputError: see :meth:`gpca.model.explainer.Explainer.explain`.
        """
        source, target = as_points(source_points, "source"), as_points(target_points, "target")
        T_init = np.eye(4) if T_target_source_init is None else np.array(T_target_source_init, np.float64)
        require_rigid(T_init, "initial pose")
        require_cloud_points(source, "source")
        frame = frame or CanonicalFrame.of(target, unit, say=OR_SCANS)
        target = frame.coordinates(_thinned(target, cloud_points, "target", notes))
        seen = _thinned(source, cloud_points, "source", notes)
        source = frame.coordinates(transform(T_init, seen))
        if T_target_source_init is not None:
            _require_near(source, unit)
        _require_like_sizes(source, target)
        normals = None if settings.method == "point_to_point" else normals_towards_camera(target)
        return cls(seen, T_init, frame, source, target, BatchedICP(target, settings, normals))


def _thinned(points: np.ndarray, cloud_points: int, role: str, notes: list[str]) -> np.ndarray:
    kept = thin(points, cloud_points, role)
    if len(kept) < len(points):
        notes.append(f"{role}: {len(kept)} of {len(points)} points, drawn at random")
    return kept


def _require_near(source: np.ndarray, unit: str) -> None:
    """Raise an InputError where a pose that was given puts the source, in diameters of the target, far from it."""
    if (distance := float(np.linalg.norm(source, axis=1).min())) > FARTHEST_START:
        fault = f"puts the source {distance:.3g} diameters of the target away from it"
        raise InputError("initial pose", fault, f"give T_target_source, with its translation in {unit}")


def _require_like_sizes(source: np.ndarray, target: np.ndarray) -> None:
    extents = [float(np.linalg.norm(np.ptp(cloud, axis=0))) for cloud in (source, target)]
    ratio = extents[0] / extents[1]
    if not 1 / LARGEST_RATIO <= ratio <= LARGEST_RATIO:
        remedy = "give both in the same unit, without points far from the object"
        raise InputError("source", f"is {ratio:.3g} times as large as the target", remedy)
