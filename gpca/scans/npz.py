"""Scenes in npz files, one in each: ``cloud_<name>`` (N, 3), and ``T_scene_cloud`` or ``T_model_cloud`` (F, 4, 4).

``T_model_cloud`` makes the scene an object. The names are in ``name`` or ``index`` (F,), in the order of the poses; a
file with neither has clouds 0 to F - 1. Beside the files may lie ``pairs.csv`` with the columns scene (the file's name
without its suffix), target, source and overlap, which lists the pairs of some or all of them.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gpca.alignment.rigid import require_rigid, scale_translation
from gpca.errors import InputError
from gpca.io.arrays import REAL, load_arrays
from gpca.io.csv_file import ANY, numbers, read_csv
from gpca.io.limits import require_file
from gpca.objects.canonical import require_points
from gpca.objects.mesh_folder import meters_per
from gpca.scans.entry import ScanEntry
from gpca.scans.pair import Kind
from gpca.scans.scene import Known, Scan, Scene

PAIRS = "pairs.csv"
REMEDY = "make it as docs/scans.md says"
POSES: dict[str, Kind] = {"T_scene_cloud": "room", "T_model_cloud": "object"}
ORDER = ("name", "index")
CLOUD = "cloud_"


def scenes(entry: ScanEntry, place: Path) -> Iterator[Scene]:
    """Yield the scene of each npz file of a folder, by name, or of the one file.

    Raises:
        InputError: no npz file, or one that does not hold what it should.
    """
    files = sorted(place.glob("*.npz")) if place.is_dir() else [place]
    if not files:
        raise InputError(place, "the folder has no npz file", "correct location")
    listed = _read_pairs(files[0].parent / PAIRS)
    for path in files:
        yield read_scene(path, entry, listed.get(path.stem, ()))


def read_scene(path: Path, entry: ScanEntry, printed: tuple[Known, ...] = ()) -> Scene:
    """Read one file.

    Raises:
        InputError: unreadable, an array missing or of another shape, NaN, a pose that is not rigid.
    """
    members = _members(path)
    poses = next((name for name in POSES if name in members), None)
    if poses is None:
        raise InputError(path, f"has neither {' nor '.join(POSES)}", REMEDY)
    order = next((name for name in ORDER if name in members), None)
    head = load_arrays(path, {poses: ("F", 4, 4)} | ({order: ("F",)} if order else {}), {poses: REAL}, remedy=REMEDY)
    names = [str(name) for name in (head[order] if order else range(len(head[poses])))]
    if len(set(names)) < len(names):
        raise InputError(path, f"array '{order}' names a cloud twice", REMEDY)
    wanted = {f"{CLOUD}{name}": (f"N{name}", 3) for name in names}
    if missing := [name for name in wanted if name not in members]:
        raise InputError(path, f"array '{missing[0]}' is missing", REMEDY)
    if more := [name for name in members if name.startswith(CLOUD) and name not in wanted]:
        raise InputError(path, f"array '{more[0]}' has no pose", REMEDY)
    clouds = load_arrays(path, wanted, dict.fromkeys(wanted, REAL), remedy=REMEDY)
    scale, scans = meters_per(entry.unit), {}
    for name, T_scene_scan in zip(names, head[poses].astype(np.float64), strict=True):
        points_N_3 = clouds[f"{CLOUD}{name}"].astype(np.float64)
        require_points(points_N_3, f"{path}, {CLOUD}{name}")
        require_rigid(T_scene_scan, f"{path}, {poses} of {name}")
        viewpoint_3 = np.zeros(3) if entry.sensor_at_origin else None
        scans[name] = Scan(points_N_3 * scale, scale_translation(T_scene_scan, scale), viewpoint_3)
    return Scene(path.stem, entry.scenes or POSES[poses], scans, printed)


def _members(path: Path) -> list[str]:
    """Return the names of the arrays of a file."""
    require_file(path, "no such file", "correct location", np.inf)
    try:
        with zipfile.ZipFile(path) as archive:
            return [name.removesuffix(".npy") for name in archive.namelist()]
    except Exception as fault:  # zipfile raises errors of many kinds for a damaged archive
        raise InputError(path, "is not a readable npz archive", "fetch it again") from fault


def _read_pairs(path: Path) -> dict[str, tuple[Known, ...]]:
    """Return the pairs that a file lists, by scene; none where there is no file. A pair may stand in several lists."""
    if not path.is_file():
        return {}
    rows = read_csv(path, ("scene", "target", "source", "overlap"), ANY, "correct it as docs/scans.md says")
    rows["overlap"] = numbers(path, rows, "overlap", least=0)
    if (rows["overlap"] > 1).any():
        raise InputError(path, "column 'overlap' contains numbers above 1", "give shares from 0 to 1")
    listed: dict[str, dict[tuple[str, str], Known]] = {}
    for scene, target, source, share in rows[["scene", "target", "source", "overlap"]].itertuples(index=False):
        listed.setdefault(scene, {})[target, source] = Known(target, source, float(share))
    return {scene: tuple(pairs.values()) for scene, pairs in listed.items()}
