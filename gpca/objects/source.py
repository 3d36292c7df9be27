"""Configured sources of objects: where their data is, and their surfaces."""

import errno
import os
from collections.abc import Iterable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

from gpca.errors import InputError
from gpca.io.arrays import require_numbers
from gpca.io.files import sha256_of_file
from gpca.objects import downloads
from gpca.objects.surface import Surface
from gpca.process.code_files import ROOT
from gpca.process.plugins import load
from gpca.process.registry import Registry

PROCEDURAL = "procedural"
SOURCES = {
    PROCEDURAL: "gpca.objects.procedural",
    "bop": "gpca.objects.bop",
    "mesh_folder": "gpca.objects.mesh_folder",
    "uw_rgbd": "gpca.objects.point_files",
}
KINDS: Registry[str] = Registry("kind of source", "", "SOURCES", first=(__name__,), outside=str)
SYSTEM = ("/dev", "/proc", "/sys")
TEXTS = (".md", ".txt")  # licenses beside data
# Keys of an entry that a procedural source ignores: a config may lay one over a source of files.
FILE_KEYS = ("location", "files", "objects", "unit", "url", "urls", "sha256", "views_per_instance")
DATA = ROOT / "data"  # the data that is part of the repository (data/README.md)
VERSION = "2"  # of the data that this code reads
RESTORE = "restore it: git checkout -- data"


def resolve(entry: dict, data_dir: str | None) -> dict:
    """Return an entry with an `origin`: "procedural", "local" (data_dir's, else ours, at `location`) or "download"."""
    subject = f"source '{entry.get('title', entry.get('kind'))}'"
    if data_dir is not None and not require_place(data_dir).is_dir():
        raise InputError(data_dir, "no such folder", "correct data_dir in the config")
    module = _module_of(entry.get("kind"))
    if entry["kind"] == PROCEDURAL:
        if not entry.get("family"):
            raise InputError(subject, "names no family", "set family in the config")
        module.require_family(entry["family"])
        return {name: value for name, value in entry.items() if name not in FILE_KEYS} | {"origin": PROCEDURAL}
    if entry.get("objects") and entry["kind"] in set(SOURCES).difference(["bop"]):  # whose objects have ids
        raise InputError("objects", f"are ids, which the kind {entry['kind']} has not", "leave it out, or use files")
    location, patterns = require_place(entry.get("location") or ""), entry.get("files") or ()
    require_patterns(patterns)
    for base in folders_of_data(data_dir) if entry.get("location") or patterns else ():
        if not (folder := require_place(base / location)).exists():
            continue
        if not folder.is_dir():
            raise InputError(folder, "is not a folder", "correct location in the config")
        require_no_root(folder)
        if entry.get("location") or all(any(folder.glob(pattern)) for pattern in patterns):
            require_whole_if_ours(folder)
            if require_entry := getattr(module, "require_entry", None):
                require_entry(entry, folder)
            if idle := [pattern for pattern in patterns if not any(folder.glob(pattern))]:
                raise InputError(f"pattern '{idle[0]}'", f"matches no file in {folder}", "correct files in the config")
            return {**entry, "origin": "local", "location": os.path.abspath(folder)}
    urls, checksums = _as_list(entry.get("urls") or entry.get("url")), _as_list(entry.get("sha256"))
    if not urls:
        wanted = entry.get("location") or ", ".join(patterns or ["location"])
        raise InputError(subject, f"{wanted} does not exist", "correct location, or set data_dir to its parent folder")
    if checksums and len(checksums) != len(urls):
        message = f"has {len(urls)} url(s) but {len(checksums)} sha256 value(s)"
        raise InputError(subject, message, "give one for each, or null")
    return {**entry, "origin": "download"}


def require_patterns(patterns: Iterable[str]) -> None:
    """Raise an InputError for a pattern that could find no files below a location."""
    remedy = "give one relative to location"
    for pattern in patterns:
        if ".." in Path(pattern).parts:
            raise InputError(f"pattern '{pattern}'", "leads out of location", remedy)
        try:
            next(Path(os.devnull).glob(pattern), None)  # nothing is below that, but the pattern is looked at
        except (ValueError, IndexError, NotImplementedError) as fault:
            raise InputError(f"pattern '{pattern}'", f"finds no files ({fault})", remedy) from fault


def require_no_root(folder: Path) -> None:
    """Raise an InputError for the root of the file system, whose files would all be searched."""
    if folder.resolve() == Path(folder.resolve().anchor):
        raise InputError(folder, "is the root of the file system", "name a folder of data in the config")


def surfaces(entry: dict, cache_folder: str | Path) -> Iterator[Surface]:
    """Yield the surfaces of a resolved entry; downloads are kept, and unpacked, in `cache_folder`."""
    module = _module_of(entry["kind"])
    if entry["origin"] == PROCEDURAL:
        yield from module.surfaces(entry["family"])
        return
    for folder in folders(entry, cache_folder):
        for surface in module.from_entry(entry, folder):
            _require_surface(surface, f"source '{entry.get('title', entry['kind'])}'")
            yield surface


def _require_surface(surface: object, subject: str) -> None:
    if not isinstance(surface, Surface) or not isinstance(surface.name, str):
        raise InputError(subject, f"yields a {type(surface).__name__}", "make it yield a named Surface")
    name, size = f"{subject}: object {surface.name!r}", (None, 3)
    vertices_m = require_numbers(surface.vertices_m, size, f"{name}: vertices_m", "f", finite=False)
    if surface.normals is not None:
        require_numbers(surface.normals, vertices_m.shape, f"{name}: normals", "f")
    if surface.faces is not None:
        faces = require_numbers(surface.faces, size, f"{name}: faces", "iu")
        if not ((faces >= 0) & (faces < len(vertices_m))).all():
            raise InputError(name, f"has faces of vertices beyond its {len(vertices_m)}", "number them from 0")


def folders(entry: dict, cache_folder: str | Path) -> list[Path]:
    """Return the folders of a resolved entry's data: its location, or one for each download."""
    if entry["origin"] == "local":
        return [Path(entry["location"])]
    cache = require_place(cache_folder)
    urls = _as_list(entry.get("urls") or entry.get("url"))
    checksums = _as_list(entry.get("sha256")) or [None] * len(urls)
    location = entry.get("location")
    files = [downloads.fetch(url, sha256, cache, location) for url, sha256 in zip(urls, checksums, strict=True)]
    # Folders are named by content, so that an archive that was fetched again is unpacked again.
    return [downloads.unpack(file, file.with_name(f"{file.stem}-{sha256_of_file(file)[:12]}")) for file in files]


def data_files(entry: dict) -> list[Path]:
    """Return the files that a local entry is read from, sorted; without patterns, all but texts as BOP has them."""
    if entry["origin"] != "local":
        return []
    patterns = entry.get("files") or ["*", "models/*"]
    matching = {path for pattern in patterns for path in Path(entry["location"]).glob(pattern)}
    return sorted(path for path in matching if path.is_file() and path.suffix not in TEXTS)


def data_folders(entry: dict, data_dir: str | None, downloads: str) -> dict[str, str]:
    """Return the one folder that a resolved entry's data comes from, so that steps depend on no other."""
    if entry["origin"] == "local":
        return {"data_dir": data_dir} if data_dir else {}
    return {"downloads": downloads} if entry["origin"] == "download" else {}


def source_modules(entry: dict) -> list[str]:
    """Return the module that reads an entry: it is imported by name at run time, so no import statement shows it."""
    return [KINDS.entries()[entry["kind"]]]


def find_file(place: str, data_dir: str | None) -> Path:
    """Return a file that a config names, in `data_dir` or the repository's data; InputError where neither has it."""
    paths = places_of(place, data_dir)
    path = next((path for path in paths if path.is_file()), None)
    if path is None:
        raise InputError(paths[-1], "no such file", "correct the config, or restore it: git checkout -- data")
    require_whole_if_ours(path)
    return path


def places_of(place: str, data_dir: str | None) -> list[Path]:
    """Return where a place that a config names may be: below `data_dir`, then in the repository's data."""
    return [require_place(base / require_place(place)).absolute() for base in folders_of_data(data_dir)]


def require_place(place: str | Path) -> Path:
    """Return a path that a user names, ``~`` resolved; InputError for circular links and folders of devices."""
    try:
        path = Path(place).expanduser()
    except RuntimeError as fault:
        raise InputError(place, "is the home folder of an unknown user", "write the full path") from fault
    try:
        path.stat()
    except OSError as fault:  # not there, perhaps: it may be downloaded
        if fault.errno == errno.ELOOP:
            raise InputError(place, "is a symbolic link that leads in a circle", "name the folder itself") from fault
    real = Path(os.path.realpath(path))
    if any(real.is_relative_to(system) for system in SYSTEM) and not real.is_relative_to("/dev/shm"):
        raise InputError(place, "is a folder of devices, not of data", "name a folder of files")
    return path


def _module_of(kind: object) -> ModuleType:
    kinds = KINDS.entries()
    if kind not in kinds:
        raise InputError(f"kind '{kind}'", "is not a kind of source", f"choose one of {', '.join(kinds)}")
    module = import_module(kinds[str(kind)]) if kind in SOURCES else load(kinds[str(kind)])
    if not hasattr(module, "surfaces" if kind == PROCEDURAL else "from_entry"):
        raise InputError(f"kind '{kind}'", f"its module {module.__name__} has no from_entry", "see docs/adding.md")
    return module


def _as_list(value: str | list | None) -> list:
    return value if isinstance(value, list) else [] if value is None else [value]


def folders_of_data(data_dir: str | Path | None) -> list[Path]:
    """Return the folders in which a relative place is sought: the user's, then the repository's."""
    return [Path(folder) for folder in (data_dir, DATA) if folder]


def require_whole_if_ours(place: Path) -> None:
    """Raise an InputError where a place lies in the repository's data and this differs from what was published."""
    if place.resolve().is_relative_to(DATA.resolve()):
        require_whole(DATA)


@cache
def require_whole(folder: Path) -> None:
    """Raise an InputError for another version of the data, or its first file that is missing or changed."""
    version = folder / "VERSION"
    if (found := version.read_text("utf-8").strip() if version.is_file() else "unknown") != VERSION:
        raise InputError(folder, f"is version {found} of the data, and this code reads version {VERSION}", RESTORE)
    sums = folder / "SHA256SUMS"
    if not sums.is_file():
        raise InputError(sums, "no such file", RESTORE)
    for line in sums.read_text("utf-8").splitlines():
        sha256, _, name = line.partition("  ")
        if not (path := folder / name).is_file():
            raise InputError(path, "no such file", RESTORE)
        if sha256_of_file(path) != sha256:
            raise InputError(path, "is not the file that SHA256SUMS lists", RESTORE)
