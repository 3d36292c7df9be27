"""The scenes of a configured data set: where its files are, and what reads them.

A kind of data set is a module beside this one with ``scenes(entry, place) -> Iterator[Scene]``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gpca.errors import InputError
from gpca.objects.source import places_of
from gpca.scans import npz, ply_folder, threedmatch
from gpca.scans.entry import ScanEntry
from gpca.scans.scene import Scan, Scene
from gpca.seeds import generator
from gpca.settings import read_settings

SUFFIXES = (".npz", ".csv", ".ply", ".txt", ".log")
DEVELOPMENT = "development"  # of the roles of a run
Reader = Callable[[ScanEntry, Path], Iterator[Scene]]
READERS: dict[str, Reader] = {
    "npz": npz.scenes,
    "ply_folder": ply_folder.scenes,
    "threedmatch": threedmatch.scenes,
}


def entry_of(settings: Mapping[str, Any]) -> ScanEntry:
    """Return an entry of the config, checked.

    Raises:
        InputError: an unknown key, a value of another type, or no location.
    """
    return read_settings(ScanEntry, settings)


def place_of(entry: ScanEntry, data_dir: str | None) -> Path | None:
    """Return the file or folder of a data set, in `data_dir` or the repository's data.

    A virtual one has none, nor has an optional one that is not there.

    Raises:
        InputError: it is nowhere, and not optional.
    """
    if entry.kind == "virtual":
        return None
    places = places_of(entry.location or "", data_dir)
    if place := next((place for place in places if place.exists()), None):
        return place
    if entry.optional:
        return None
    remedy = f"get it from {entry.address}" if entry.address else "correct location, or set data_dir"
    raise InputError(places[0], "no such file or folder", remedy)


def data_files(entry: ScanEntry, data_dir: str | None) -> list[Path]:
    """Return the files that a data set is read from, sorted; none of a virtual one."""
    if (place := place_of(entry, data_dir)) is None:
        return []
    files = [place] if place.is_file() else [path for path in place.rglob("*") if path.suffix.lower() in SUFFIXES]
    return sorted(files)


def scenes_of(entry: ScanEntry, place: Path | None, role: str, most_points: int) -> Iterator[Scene]:
    """Yield the scenes of a data set, one by one.

    Args:
        place: of its files; None of a virtual one.
        role: of the run: ``development`` has other scenes than ``evaluation``, as the entry says.
        most_points: larger scans are thinned to so many of their points, drawn at random.

    Raises:
        InputError: no scenes of the role, or what the reader refuses.
    """
    if entry.kind == "virtual":
        from gpca.scans import virtual  # loads trimesh, which nothing needs that plans a run

        found: Iterator[Scene] = virtual.scenes(entry, role == DEVELOPMENT)
    elif place is None:
        raise InputError(entry.title, "its data is not there", "set data_dir")
    else:
        found = (
            scene
            for scene in READERS[entry.kind](entry, place)
            if (scene.name in entry.development) == (role == DEVELOPMENT)
        )
    empty = True
    for scene in found:
        empty = False
        yield _thinned(replace(scene, family=entry.families.get(scene.name, "")), most_points)
    if empty:
        raise InputError(place or entry.title, f"has no scene for {role}", "correct development in the entry")


def _thinned(scene: Scene, most: int) -> Scene:
    """Return the scene with no more than `most` points in each scan."""
    scans = {}
    for name, scan in scene.scans.items():
        points_N_3 = scan.points_N_3
        if len(points_N_3) > most:
            kept = generator("scans", scene.name, name, "points").permutation(len(points_N_3))[:most]
            points_N_3 = points_N_3[np.sort(kept)]
        scans[name] = Scan(points_N_3, scan.T_scene_scan, scan.viewpoint_3)
    return replace(scene, scans=scans)
