"""The virtual tables of a run, where explainers learn, are calibrated, actions are rehearsed, and policies are judged.

No two parts share a table.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from gpca.environment import require_open3d
from gpca.errors import InputError
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.situations import Shelf, Situations
from gpca.objects.surface import Surface
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.synthesis import as_registrations
from gpca.progress import progress
from gpca.recovery.cases import register_first
from gpca.recovery.settings import LoopSettings, RecoverySettings

MOST_FACES = 2000  # of a mesh; what decimation moves is far below the noise of depth
PARTS = ("train", "test", "rehearsals", "failures")


def lay_tables(
    surfaces: Iterable[Surface], settings: RecoverySettings, source: str, seed: int
) -> dict[str, Situations]:
    """Return the situations of every part; source and seed name all that is random in them.

    Raises:
        InputError: an object is a cloud of points, which hides nothing.
    """
    surfaces = [simplified(surface) for surface in surfaces]
    recovery = settings.section
    shelf = Shelf(surfaces, source, recovery["model_points"], InitialPoseSettings(**recovery["estimator"]))
    return {part: Situations(shelf, settings.situation, (source, seed, part)) for part in PARTS}


def simplified(surface: Surface, most_faces: int = MOST_FACES) -> Surface:
    """Return a mesh of at most so many faces, by quadric decimation (Garland and Heckbert 1997): scans have more.

    Raises:
        InputError: a cloud of points.
    """
    if surface.faces is None:
        fault = f"object '{surface.name}' is a point cloud, but the camera needs a mesh"
        raise InputError("recovery.objects", fault, "name a source of meshes")
    if len(surface.faces) <= most_faces:
        return surface
    o3d = require_open3d()
    vertices, triangles = o3d.utility.Vector3dVector, o3d.utility.Vector3iVector
    mesh = o3d.geometry.TriangleMesh(vertices(surface.vertices_m), triangles(surface.faces.astype(np.int32)))
    mesh = mesh.simplify_quadric_decimation(most_faces)
    return Surface(surface.name, np.asarray(mesh.vertices), np.asarray(mesh.triangles).astype(np.int64))


def register_situations(
    situations: Mapping[str, Situations], train: int, calibration: int, settings: LoopSettings
) -> Registrations:
    """Register situations of all causes, failed or not: what the classifier learns from, and is judged by.

    Samples 3t to 3t + 2 of a split are of the three causes. The calibration samples are the split ``test``.

    Args:
        situations: those of ``train`` and ``test``, which share no table.
    """
    records = []
    for split, count in (("train", train), ("test", calibration)):
        for number in progress(range(count), f"situations of split {split}"):
            cause = CONCEPTS[number % len(CONCEPTS)]
            start, redraw = None, 0
            while start is None:
                situation, _ = situations[split].draw(cause, cause, number, redraw)
                start = register_first(situation, settings.cloud_points, settings.icp)
                redraw += 1
            records.append(start.record | {"sample": number, "split": split})
    return as_registrations(records)[0]
