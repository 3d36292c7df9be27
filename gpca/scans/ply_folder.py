"""Scenes in folders of PLY files with a file of poses.

A folder with ``poses.txt`` is one scene; otherwise each folder in it that has one. A line of ``poses.txt`` has the name
of a file without its suffix and the 16 numbers of its pose in the scene, row by row, in the unit of the points; ``#``
starts a comment. The other files of the folder do not count.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gpca.alignment.rigid import require_rigid, scale_translation
from gpca.errors import InputError
from gpca.io.limits import require_file
from gpca.numerals import decimal
from gpca.objects.mesh_folder import meters_per, read_surface
from gpca.scans.entry import ScanEntry
from gpca.scans.scene import Scan, Scene

POSES = "poses.txt"
LINE = "write a name and the 16 numbers of a pose in each line"


def scenes(entry: ScanEntry, place: Path) -> Iterator[Scene]:
    """Yield the scene of the folder, or of each folder in it, by name.

    Raises:
        InputError: no such folder, no file of poses, or what a file does not hold that it should.
    """
    if not entry.scenes:
        raise InputError(entry.title, "does not say what its scenes are", "set scenes: room, or object")
    files = [place / POSES] if (place / POSES).exists() else sorted(place.glob(f"*/{POSES}"))
    if not files:
        raise InputError(place / POSES, "no such file", "give the poses of the scans as docs/scans.md says")
    scale = meters_per(entry.unit)
    for path in files:
        scans = {}
        for name, T_scene_scan in read_poses(path).items():
            points_N_3 = read_surface(path.with_name(f"{name}.ply"), scale).vertices_m
            viewpoint_3 = np.zeros(3) if entry.sensor_at_origin else None
            scans[name] = Scan(points_N_3, scale_translation(T_scene_scan, scale), viewpoint_3)
        yield Scene(path.absolute().parent.name, entry.scenes, scans)


def read_poses(path: Path) -> dict[str, np.ndarray]:
    """Return the pose (4×4) of each scan by name.

    Raises:
        InputError: no such file, other than 17 words in a line, no number, no rigid transform, a name twice.
    """
    require_file(path, "no such file", LINE)
    poses: dict[str, np.ndarray] = {}
    for number, line in enumerate(path.read_text("utf-8", errors="replace").splitlines(), 1):
        if not (words := line.split("#")[0].split()):
            continue
        subject = f"{path}, line {number}"
        if len(words) != 17:
            raise InputError(subject, f"has {len(words)} words", LINE)
        if Path(words[0]).name != words[0] or words[0] in poses:
            raise InputError(subject, f"'{words[0]}' is no name of a file beside it, or stands there twice", LINE)
        try:
            T_scene_scan = np.array([decimal(word) for word in words[1:]]).reshape(4, 4)
        except ValueError as fault:
            raise InputError(subject, str(fault), LINE) from fault
        require_rigid(T_scene_scan, subject)
        poses[words[0]] = T_scene_scan
    if not poses:
        raise InputError(path, "has no poses", LINE)
    return poses
