"""A surface, which every kind of source yields: a mesh or a point cloud in meters; and views, told by their names.

RGB-D datasets have views: clouds of one instance from several sides.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

T = TypeVar("T")


@dataclass(frozen=True)
class Surface:
    """One object as its source gives it.

    Attributes:
        name: unique within the source.
        vertices_m: (V, 3) float64, meters, in the source's own frame.
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


def evenly(items: Sequence[T], most: int) -> list[T]:
    """Return at most so many of the items, spread evenly over them.

    The end is left out: the last frame of a turntable is the neighbor of its first.
    """
    return [items[i] for i in np.linspace(0, len(items), min(most, len(items)), endpoint=False).astype(int)]


def instance_of(name: str) -> str:
    """Return the instance that a view is of, by its name; a name of another form is an instance of its own."""
    return view_order(name)[0]


def view_order(name: str) -> tuple[str, int, int]:
    """Return instance, sequence and frame of a name such as ``coffee_mug_1_2_14``; else the name itself, 0 and 0."""
    match = re.fullmatch(r"(.+)_([0-9]+)_([0-9]+)", name)
    return (match[1], int(match[2]), int(match[3])) if match else (name, 0, 0)
