"""A surface: what every kind of source yields, a mesh or a point cloud in meters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Surface:
    """One object as its source gives it.

    Attributes:
        name: unique within the source.
        vertices_m: (V, 3) float64, metres, in the source's own frame.
        faces: (F, 3) int64 triangles, or None for a point cloud.
        normals: (V, 3) unit normals of a point cloud; estimated from the points when None. Unused for meshes.
    """

    name: str
    vertices_m: np.ndarray
    faces: np.ndarray | None
    normals: np.ndarray | None = None

    @property
    def triangles(self) -> np.ndarray:
        """The faces of a surface that is known to be a mesh."""
        if self.faces is None:
            raise ValueError(f"{self.name} is a point cloud")
        return self.faces
