"""What a robot's shots show around an object, compared with what they would show if it were somewhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gpca.alignment.rigid import inverse
from gpca.frames.camera import MeshScene
from gpca.frames.shots import Shot

THINNED = 4  # every so many pixels of an image, both ways, one is looked at


class Appearance:
    """Some pixels of shots, and the mesh of the object alone, in its own frame."""

    def __init__(self, shots: Sequence[Shot], mesh: MeshScene) -> None:
        thinned = np.s_[THINNED // 2 :: THINNED, THINNED // 2 :: THINNED]
        self._mesh = mesh
        self._looks = [
            (shot.T_world_camera, shot.camera.rays()[thinned], shot.depth_m[thinned], shot.mask[thinned])
            for shot in shots
        ]

    def explained(self, T_world_object: np.ndarray, reach_m: float) -> float:
        """Return the share of the pixels that agree with a pose, of those that show the object or should.

        A pixel agrees where the object is seen as far away as the mesh is, within `reach_m`. It disagrees where the
        object is seen and the mesh is not there or elsewhere, and where the camera looked through the mesh at something
        behind it. What stands in front of the mesh says nothing.
        """
        agreeing = judged = 0
        for T_world_camera, rays, depth_m, is_object in self._looks:
            rendered_m = self._mesh.along(rays, inverse(T_world_object) @ T_world_camera).depth_m
            measured = depth_m > 0
            hidden = ~is_object & (depth_m < rendered_m - reach_m)
            expected = np.isfinite(rendered_m)
            near = np.abs(np.where(expected, rendered_m, np.inf) - depth_m) < reach_m
            agreeing += (measured & is_object & near).sum()
            judged += (measured & (is_object | (expected & ~hidden))).sum()
        return float(agreeing / max(1, judged))
