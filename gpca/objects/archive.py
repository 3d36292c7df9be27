"""Archives read without trust: zip, tar and tgz, every member checked before anything is written."""

from __future__ import annotations

import gzip
import os
import shutil
import stat
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PureWindowsPath
from typing import IO

from gpca.errors import InputError

LARGEST_BYTES = 20 * 10**9
REMEDY = "delete it and fetch it again, or check the url"
_DAMAGE = (tarfile.TarError, zipfile.BadZipFile, gzip.BadGzipFile, EOFError, zlib.error, NotImplementedError)


@dataclass(frozen=True)
class Member:
    """A regular file in an archive: its relative path there, its size in bytes, and `open`, which gives a stream."""

    archive: Path
    name: str
    size: int
    open: Callable[[], IO[bytes]]

    def read(self) -> bytes:
        """Return the content; InputError when it is damaged."""
        with _damage_named(self.archive), self.open() as stream:
            return stream.read()


@contextmanager
def open_archive(path: str | Path, largest_bytes: int = LARGEST_BYTES) -> Iterator[list[Member]]:
    """Yield the regular files of an archive, readable within the context.

    Raises:
        InputError: missing, truncated or of another format; a member that is a link, a device or encrypted, or
            whose path leaves the archive's folder; more than `largest_bytes` unpacked.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(path, "no such file", "check url or files in the config")
    with _damage_named(path):
        archive, list_members = _open(path)
    with archive:
        with _damage_named(path):
            members = list_members(archive, path, largest_bytes)
        yield members


def unpack(path: str | Path, folder: str | Path, largest_bytes: int = LARGEST_BYTES) -> Path:
    """Unpack an archive into a new folder, whole or not at all; an existing folder is taken as done.

    Returns:
        The folder.

    Raises:
        InputError: see :func:`open_archive`.
    """
    folder = Path(folder)
    if folder.is_dir():
        return folder
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".unpacking-") as temporary:
        content = Path(temporary, "content")
        content.mkdir()
        with open_archive(path, largest_bytes) as members:
            for member in members:
                _write(member, content / member.name)
        os.replace(content, folder)
    return folder


def _write(member: Member, target: Path) -> None:
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with _damage_named(member.archive), member.open() as stream, target.open("wb") as file:
            shutil.copyfileobj(stream, file)
    except (FileExistsError, IsADirectoryError, NotADirectoryError) as fault:
        raise InputError(member.archive, f"member '{member.name}' is both a file and a folder", REMEDY) from fault


@contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    try:
        yield
    except _DAMAGE as fault:
        raise InputError(path, f"is a truncated or damaged archive ({fault})", REMEDY) from fault


def _open(path: Path):
    with path.open("rb") as file:
        magic = file.read(2)
    if magic == b"PK":
        return zipfile.ZipFile(path), _zip_members
    if magic == b"\x1f\x8b":
        return tarfile.open(path, "r:gz"), _tar_members
    return tarfile.open(path, "r:"), _tar_members


def _zip_members(archive: zipfile.ZipFile, path: Path, largest_bytes: int) -> list[Member]:
    members = []
    for info in archive.infolist():
        _check(info.filename, path)
        if stat.S_ISLNK(info.external_attr >> 16) or info.flag_bits & 1:
            raise InputError(path, f"member '{info.filename}' is a link or encrypted", REMEDY)
        if not info.is_dir():
            members.append(Member(path, info.filename, info.file_size, partial(archive.open, info)))
    _check_size(sum(member.size for member in members), path, largest_bytes)
    return members


def _stream(archive: tarfile.TarFile, info: tarfile.TarInfo) -> IO[bytes]:
    stream = archive.extractfile(info)
    assert stream is not None  # only links and folders have none
    return stream


def _tar_members(archive: tarfile.TarFile, path: Path, largest_bytes: int) -> list[Member]:
    members = []
    total = 0
    for info in archive:
        _check(info.name, path)
        if not (info.isreg() or info.isdir()):
            raise InputError(path, f"member '{info.name}' is a link or a device", REMEDY)
        total += info.size
        _check_size(total, path, largest_bytes)  # now, before more of a bomb is decompressed to find the next header
        if info.isreg():
            members.append(Member(path, info.name, info.size, partial(_stream, archive, info)))
    # tarfile takes a tar that is cut between two members, or a damaged header, for the end: a whole one ends in zeros.
    archive.fileobj.seek(archive.offset)
    if archive.fileobj.read(tarfile.BLOCKSIZE) != bytes(tarfile.BLOCKSIZE):
        raise tarfile.ReadError("no end mark")
    while rest := archive.fileobj.read(1 << 20):  # read on to the end, where gzip keeps the checksum of all
        total += len(rest)
        _check_size(total, path, largest_bytes)
    return members


def _check(name: str, path: Path) -> None:
    relative = PureWindowsPath(name)  # takes / and \\ for separators and knows drives, so nothing absolute escapes it
    if relative.anchor or ".." in relative.parts:
        raise InputError(path, f"member '{name}' would leave the folder it is unpacked into", REMEDY)


def _check_size(total: int, path: Path, largest_bytes: int) -> None:
    if total > largest_bytes:
        raise InputError(path, f"would unpack to more than {largest_bytes / 1e9:.3g} GB", REMEDY)
