"""UW RGB-D Object Dataset: single views of objects, already cut out, as PCD files or in the dataset's tars.

Lai, Bo, Ren, Fox: A Large-Scale Hierarchical Multi-View RGB-D Object Dataset, ICRA 2011. A view is named
<class>_<instance>_<sequence>_<frame>, e.g. coffee_mug_1_1_1; points are in meters in the camera's frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import groupby
from pathlib import Path, PurePosixPath

from gpca.errors import InputError
from gpca.io.limits import require_file
from gpca.objects.downloads import open_archive
from gpca.objects.mesh_folder import files_in, meters_per
from gpca.objects.point_files import parse_pcd
from gpca.objects.surface import Surface, evenly, instance_of, view_order

SUFFIXES = (".pcd", ".tar", ".tar.gz", ".tgz")
READS_ARCHIVES = True  # only a few of the 600 views in a tar are wanted, so nothing is unpacked

_View = tuple[str, Callable[[], bytes], str]  # name, reader of its bytes, subject for messages


def from_entry(entry: dict, place: Path) -> Iterator[Surface]:
    """Return surfaces of a configured source: keys `files`, `unit` (default m), `views_per_instance` (default 6)."""
    paths = [place] if place.is_file() else files_in(place, entry.get("files"), SUFFIXES)
    return surfaces(paths, entry.get("unit", "m"), entry.get("views_per_instance", 6))


def surfaces(paths: Iterable[Path], unit: str = "m", views_per_instance: int = 6) -> Iterator[Surface]:
    """Yield views of each instance of PCD files and tars of them, spread evenly in the order of sequence and frame.

    Args:
        unit: of the points.
        views_per_instance: at most, of one tar or of the single files.

    Raises:
        InputError: damaged tar or PCD, a tar without PCD, NaN.
    """
    paths = [Path(path) for path in paths]
    scale = meters_per(unit)
    single = [path for path in paths if path.suffix.lower() == ".pcd"]
    for path in single:
        require_file(path, "no such file", "check files in the config")
    yield from _chosen([(path.stem, path.read_bytes, str(path)) for path in single], scale, views_per_instance)
    for path in (path for path in paths if path not in single):
        with open_archive(path) as members:
            views = [
                (PurePosixPath(member.name).stem, member.read, f"{path}, member {member.name}")
                for member in members
                if member.name.lower().endswith(".pcd")
            ]
            if not views:
                raise InputError(path, "the archive has no .pcd file", "check url or files in the config")
            yield from _chosen(views, scale, views_per_instance)


def _chosen(views: list[_View], scale: float, views_per_instance: int) -> Iterator[Surface]:
    views = sorted(views, key=lambda view: view_order(view[0]))
    for _, group in groupby(views, key=lambda view: instance_of(view[0])):
        for name, read, subject in evenly(list(group), views_per_instance):
            yield Surface(name, parse_pcd(read(), subject) * scale, None)
