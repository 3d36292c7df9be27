"""Single views of meshes, rendered by a virtual depth camera with a sensor's noise: a kind of source.

The camera goes round an object as those of the UW RGB-D Object Dataset do (Lai et al. 2011), whose objects stand on a
turntable: 30, 45 and 60 degrees above it in turn. Views are named as there, ``obj_000007_1_0`` by mesh, elevation and
number.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.frames.bop import back_project
from gpca.frames.camera import Camera, DepthNoise, MeshScene, look_at
from gpca.objects import mesh_folder
from gpca.objects.canonical import bounding_center
from gpca.objects.surface import Surface
from gpca.seeds import generator

VIEWS = 6
ELEVATIONS_DEG = (30, 45, 60)
DISTANCE_M = 0.8
CAMERA, NOISE = Camera(), DepthNoise()


def from_entry(entry: dict, folder: Path) -> Iterator[Surface]:
    """Return surfaces of a configured source: keys `files`, `unit` and `views_per_instance` (default 6)."""
    for surface in mesh_folder.from_entry(entry, folder):
        yield from views(surface, entry.get("views_per_instance", VIEWS))


def views(mesh: Surface, count: int) -> Iterator[Surface]:
    """Yield views of a mesh whose z axis points up, as clouds in the camera's frame, in meters.

    Raises:
        InputError: a cloud, which cannot be rendered, or a mesh that the camera does not see.
    """
    if mesh.faces is None:
        raise InputError(f"object '{mesh.name}'", "is a cloud, of which there are no views", "use kind: mesh_folder")
    center_m = bounding_center(mesh)
    scene = MeshScene([(mesh.vertices_m, mesh.faces)])
    for number in range(count):
        level = number % len(ELEVATIONS_DEG)
        elevation, azimuth = np.deg2rad(ELEVATIONS_DEG[level]), 2 * np.pi * number / count
        flat = np.cos(elevation) * np.array([np.cos(azimuth), np.sin(azimuth)])
        T_world_camera = look_at(center_m + DISTANCE_M * np.array([*flat, np.sin(elevation)]), center_m)
        name = f"{mesh.name}_{level + 1}_{number}"
        depth_m = NOISE.measure(scene.look(CAMERA, T_world_camera), generator(name, "view"))
        points_m, _ = back_project(depth_m, depth_m > 0, CAMERA.matrix_3_3)
        if len(points_m) == 0:
            raise InputError(f"object '{mesh.name}'", f"is not seen from {DISTANCE_M} m", "check unit in the config")
        yield Surface(name, points_m, None)
