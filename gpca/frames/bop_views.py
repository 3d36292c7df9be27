"""Single views of objects in the depth frames of a BOP dataset, cut out by their masks: a kind of source.

A view is a cloud in the camera's frame. It is named ``obj_000014_48_1002`` by its object, the scene, and the image with
the place of the object among the image's annotations; so all views of an object are one instance.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.frames.bop import TooFewPoints, measured_points, read_frames
from gpca.objects.mesh_folder import meters_per
from gpca.objects.surface import Surface, evenly

VIEWS = 6  # of an object, as of an instance of UW's
FARTHEST = 3.0  # times the median distance from the middle: what lies beyond is behind the rim of a mask
NAMES = 1000  # objects of an image at most


def from_entry(entry: dict, folder: Path) -> Iterator[Surface]:
    """Return surfaces of a configured source: keys `objects` (ids, default all) and `views_per_instance` (default 6).

    Raises:
        InputError: a unit other than that of the format, and what :func:`surfaces` refuses.
    """
    if meters_per(entry.get("unit") or "mm") != meters_per("mm"):
        raise InputError(f"unit '{entry['unit']}'", "is not that of BOP frames", "leave unit out")
    return surfaces(folder, entry.get("objects"), entry.get("views_per_instance", VIEWS))


def surfaces(folder: Path, objects: Sequence[int] | None = None, views: int = VIEWS) -> Iterator[Surface]:
    """Yield the views of each object, spread evenly over its frames; those with too few points are named on stderr.

    Args:
        folder: the dataset's.
        objects: ids; all that the frames show when None.
        views: of an object, at most.

    Raises:
        InputError: faulty files (:mod:`gpca.frames.bop`), or an object that no frame shows.
    """
    shown: dict[int, list] = {}
    for frame in read_frames([folder]):
        for place, annotation in enumerate(frame.annotations):
            shown.setdefault(annotation.object_id, []).append((frame, place))
    wanted = sorted(shown) if not objects else sorted(objects)
    if missing := [number for number in wanted if number not in shown]:
        raise InputError(folder, f"no frame shows object {missing[0]}", "check objects in the config")
    for number in wanted:
        for frame, place in evenly(shown[number], views):
            try:
                points_m, _ = measured_points(frame, frame.annotations[place], frame.depth_m())
            except TooFewPoints as fault:
                print(f"skipped: {fault}", file=sys.stderr)
                continue
            name = f"obj_{number:06d}_{frame.scene}_{NAMES * frame.image + place}"
            yield Surface(name, within_rim(points_m), None)


def within_rim(points_m: np.ndarray) -> np.ndarray:
    """Return points (P, 3) without those that a mask's rim has of the background.

    The diameter of the object is not known here, but most points are its own.
    """
    distances_P = np.linalg.norm(points_m - np.median(points_m, axis=0), axis=1)
    return points_m[distances_P <= FARTHEST * np.median(distances_P)]
