"""The data that is part of the repository: where it is, and whether it is whole (data/README.md)."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from gpca.code_files import ROOT
from gpca.errors import InputError
from gpca.io.files import sha256_of_file

DATA = ROOT / "data"
VERSION = "2"  # of the data that this code reads
REMEDY = "restore it: git checkout -- data"


def folders_of_data(data_dir: str | Path | None) -> list[Path]:
    """Return the folders that a relative place of data is looked for in: the user's first, then the repository's."""
    return [Path(folder) for folder in (data_dir, DATA) if folder]


def require_whole_if_ours(place: Path) -> None:
    """Raise an InputError where a place lies in the repository's data and this is not as it was published."""
    if place.resolve().is_relative_to(DATA.resolve()):
        require_whole(DATA)


@cache
def require_whole(folder: Path) -> None:
    """Raise an InputError for the first file of the data that is missing or changed, and for another version of it."""
    version = folder / "VERSION"
    if (found := version.read_text("utf-8").strip() if version.is_file() else "unknown") != VERSION:
        raise InputError(folder, f"is version {found} of the data, and this code reads version {VERSION}", REMEDY)
    sums = folder / "SHA256SUMS"
    if not sums.is_file():
        raise InputError(sums, "no such file", REMEDY)
    for line in sums.read_text("utf-8").splitlines():
        sha256, _, name = line.partition("  ")
        if not (path := folder / name).is_file():
            raise InputError(path, "no such file", REMEDY)
        if sha256_of_file(path) != sha256:
            raise InputError(path, "is not the file that SHA256SUMS lists", REMEDY)
