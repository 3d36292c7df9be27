"""Downloads kept in a cache and checked by SHA-256, and archives (zip, tar, tgz) unpacked without trusting them."""

from __future__ import annotations

import gzip
import hashlib
import json
import math
import os
import re
import shutil
import stat
import sys
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PureWindowsPath
from threading import Thread
from time import monotonic
from typing import IO, Any
from urllib.parse import urlsplit

from gpca.errors import InputError
from gpca.io.files import LARGEST_FILE_BYTES, is_bounded, require_file, sha256_of_file, whole_file, whole_folder
from gpca.io.structured_text import read_json

TIMEOUT_S = 30
# A server that sends a byte now and then would keep a run waiting forever. After a minute, the average rate has to be
# 10 kB/s, a fifth of a modem's; the largest known download has 15 GB.
GRACE_S, SLOWEST_BYTES_PER_S = 60, 10_000
LARGEST_DOWNLOAD_BYTES = 10**11
LARGEST_UNPACKED_BYTES = 20 * 10**9  # the largest archive of the BOP benchmark unpacks to somewhat less
LONGEST_HEADER = 2**20  # bytes before a member, such as its long name; tarfile reads them as a whole
REMEDY = "delete it and fetch it again, or check the url"
_DAMAGE = (tarfile.TarError, zipfile.BadZipFile, gzip.BadGzipFile, EOFError, zlib.error, NotImplementedError)


def fetch(url: str, sha256: str | None, folder: str | Path, location: str | None = None) -> Path:
    """Return the file of `url`, from the cache `folder` or downloaded to it, under the host and path of the URL.

    Without an expected `sha256`, the actual one is printed so that it can be pinned. `location` is that of the same
    data below data_dir; the message names it when the network fails. InputError for no network, an error answer, an
    interrupted transfer, or another checksum: the download is removed then, but a file that was in the cache stays.
    """
    path = cached_path(url, folder)
    if path.is_file():
        _check(path, sha256, url, f"delete {path} to fetch it again or correct sha256 in the config")
        return path
    print(f"downloading {url} to {path}", file=sys.stderr)
    with whole_file(path) as partial:
        remedy = f"set data_dir to a folder that contains {location or 'the data'}, or download it by hand to {path}"
        _download(url, partial, remedy)
        actual = _check(partial, sha256, url, "the download was removed; try again, or correct sha256 in the config")
    if sha256 is None:
        print(f"sha256 of {url}: {actual} (pin it in the config)", file=sys.stderr)
    return path


def cached_path(url: str, folder: str | Path) -> Path:
    """Return where the cache keeps the file of `url`; InputError for an address that is not http or https."""
    parts = urlsplit(url)
    names = [name for name in parts.path.split("/") if name not in ("", ".", "..")]
    if parts.scheme not in ("http", "https") or not parts.hostname or not names:
        raise InputError(url, "is not an http or https address of a file", "correct url in the config")
    if parts.query:
        names[-1] += "_" + re.sub(r"[^\w.-]", "_", parts.query)
    return Path(folder, parts.hostname, *names)


def _check(path: Path, expected: str | None, url: str, remedy: str) -> str:
    actual = sha256_of_file(path)
    if expected is not None and actual != expected.lower():
        raise InputError(url, f"the checksum does not match: expected sha256 {expected}, got {actual}", remedy)
    return actual


def _download(url: str, path: Path, remedy: str) -> None:
    import pooch
    import requests

    download = pooch.HTTPDownloader(progressbar=True, chunk_size=1 << 16, timeout=TIMEOUT_S)
    faults: list[BaseException] = []

    def run() -> None:
        try:
            download(url, str(path), None)
        except BaseException as fault:
            faults.append(fault)

    # In a thread that ends with the process, so that a download that is too slow or too large can be left to itself.
    thread = Thread(target=run, daemon=True)
    started = monotonic()
    thread.start()
    while thread.is_alive():
        thread.join(1)
        size = path.stat().st_size if path.exists() else 0
        if thread.is_alive() and size < SLOWEST_BYTES_PER_S * (monotonic() - started - GRACE_S):
            raise InputError(url, f"sent {size} bytes in {monotonic() - started:.0f} s, which is too slow", remedy)
        if size > LARGEST_DOWNLOAD_BYTES:
            raise InputError(url, f"sends more than {LARGEST_DOWNLOAD_BYTES} bytes", remedy)
    try:
        if faults:
            raise faults[0]
    except requests.exceptions.HTTPError as fault:
        answer = str(fault) if fault.response is None else f"{fault.response.status_code} {fault.response.reason}"
        raise InputError(url, f"cannot be fetched: the server answered {answer}", remedy) from fault
    except (requests.exceptions.ConnectionError, requests.exceptions.Timeout) as fault:
        raise InputError(url, "cannot be reached", remedy) from fault
    except requests.exceptions.RequestException as fault:
        raise InputError(url, f"the transfer was interrupted ({type(fault).__name__})", remedy) from fault


@dataclass(frozen=True)
class Member:
    """A regular file in an archive: its relative path there, its size in bytes, and what opens a stream of it."""

    archive: Path
    name: str
    size: int
    open: Callable[[], IO[bytes]]

    def read(self) -> bytes:
        """Return the content; InputError when it is damaged, or too large to be parsed."""
        if self.size > LARGEST_FILE_BYTES:
            most = f"more than the limit of {LARGEST_FILE_BYTES / 1e9:.3g} GB"
            raise InputError(self.archive, f"member '{self.name}' is {self.size / 1e9:.3g} GB, {most}", REMEDY)
        with _damage_named(self.archive), self.open() as stream:
            return stream.read()


@contextmanager
def open_archive(path: str | Path, largest_bytes: int = LARGEST_UNPACKED_BYTES) -> Iterator[list[Member]]:
    """Yield the regular files of an archive, readable within the context.

    InputError for a damaged archive, or more than `largest_bytes` unpacked; for a member that is a link, a device or
    encrypted, or whose path leaves the archive's folder.
    """
    path = Path(path)
    require_file(path, "no such file", "check url or files in the config", math.inf)
    with _damage_named(path):
        archive = _open(path)
    with archive:
        with _damage_named(path):
            members = _checked(
                path, largest_bytes, _zipped(archive) if isinstance(archive, zipfile.ZipFile) else _tarred(archive)
            )
        yield members


def unpack(path: str | Path, folder: str | Path, largest_bytes: int = LARGEST_UNPACKED_BYTES) -> Path:
    """Unpack an archive into a folder, whole or not at all, with a list of SHA-256 beside it, and return the folder.

    A folder that was unpacked before is checked against its list. InputError as in :func:`open_archive`, for too little
    space on the disk, and for a file of the folder that was changed, is missing or is not from the archive.
    """
    folder = Path(folder)
    listed = folder.with_name(f"{folder.name}.sha256.json")
    if folder.is_dir() and listed.is_file():
        _require_listed(folder, listed)
        return folder
    with open_archive(path, largest_bytes) as members, whole_folder(folder) as content:
        needed, free = sum(member.size for member in members), shutil.disk_usage(content).free
        if needed > free:
            fault = f"unpacks to {needed / 1e9:.3g} GB, but {free / 1e9:.3g} GB of the disk are free"
            raise InputError(path, fault, f"free some space or keep downloads outside {folder.parent}")
        sha256_of = {os.path.normpath(member.name): _write(member, content / member.name) for member in members}
    with whole_file(listed) as partial:
        partial.write_text(json.dumps(sha256_of, indent=0))
    return folder


def _write(member: Member, target: Path) -> str:
    """Write a member piece by piece and return its SHA-256."""
    digest = hashlib.sha256()
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with _damage_named(member.archive), member.open() as stream, target.open("wb") as file:
            while piece := stream.read(1 << 20):
                digest.update(piece)
                file.write(piece)
    except (FileExistsError, IsADirectoryError, NotADirectoryError) as fault:
        raise InputError(member.archive, f"member '{member.name}' is both a file and a folder", REMEDY) from fault
    return digest.hexdigest()


def _require_listed(folder: Path, listed: Path) -> None:
    remedy = f"remove {folder} and {listed.name} beside it, and the archive will be unpacked again"
    expected = read_json(listed, "a list of files", remedy)
    # Desktops leave files that begin with a dot; no reader takes them for data.
    present = {str(file.relative_to(folder)) for file in folder.rglob("*") if file.is_file() or file.is_symlink()}
    for name in sorted({*expected, *(name for name in present if not Path(name).name.startswith("."))}):
        if name not in present:
            raise InputError(folder / name, "is missing from what was unpacked", remedy)
        if name not in expected:
            raise InputError(folder / name, "is not from the archive that was unpacked here", remedy)
        if sha256_of_file(folder / name) != expected[name]:
            raise InputError(folder / name, "was changed after it was unpacked", remedy)


@contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    try:
        yield
    except _DAMAGE as fault:
        raise InputError(path, f"is a truncated or damaged archive ({fault})", REMEDY) from fault


def _open(path: Path) -> zipfile.ZipFile | tarfile.TarFile:
    with path.open("rb") as file:
        magic = file.read(2)
    if magic == b"PK":
        return zipfile.ZipFile(path)
    return tarfile.open(path, "r:gz" if magic == b"\x1f\x8b" else "r:", tarinfo=_TarInfo)


class _TarInfo(tarfile.TarInfo):
    """A tar member that refuses a long header: listing the members would read it into memory."""

    @classmethod
    def frombuf(cls, buf: bytes | bytearray, encoding: str, errors: str) -> _TarInfo:
        info = super().frombuf(buf, encoding, errors)
        if info.type not in tarfile.REGULAR_TYPES and info.size > LONGEST_HEADER:
            raise tarfile.ReadError(f"a header of {info.size} bytes")
        return info


Entry = tuple[str, int, str, Callable[[], Any] | None]  # name, bytes, fault of its kind, opener unless a folder


def _checked(path: Path, largest_bytes: int, entries: Iterable[Entry]) -> list[Member]:
    """Return the members, each checked before the next is looked for: a bomb may have to be decompressed to find it.

    The filters of the standard library do not suffice: that of tarfile lets links pass, and both tarfile and zipfile
    strip a leading slash in silence.
    """
    members, total = [], 0
    for name, size, fault, open_it in entries:
        relative = PureWindowsPath(name)  # takes / and \\ for separators and knows drives: nothing absolute escapes it
        if relative.anchor or ".." in relative.parts:
            raise InputError(path, f"member '{name}' would leave the folder it is unpacked into", REMEDY)
        if fault:
            raise InputError(path, f"member '{name}' is {fault}", REMEDY)
        total += size
        if total > largest_bytes:
            raise InputError(path, f"would unpack to more than {largest_bytes / 1e9:.3g} GB", REMEDY)
        if open_it:
            members.append(Member(path, name, size, open_it))
    return members


def _zipped(archive: zipfile.ZipFile) -> Iterator[Entry]:
    for info in archive.infolist():
        fault = "" if is_bounded(info) else "compressed by a method other than deflate"
        if stat.S_ISLNK(info.external_attr >> 16) or info.flag_bits & 1:
            fault = "a link or encrypted"
        yield info.filename, info.file_size, fault, None if info.is_dir() else partial(archive.open, info)


def _tarred(archive: tarfile.TarFile) -> Iterator[Entry]:
    for info in archive:
        fault = "" if info.isreg() or info.isdir() else "a link or a device"
        yield info.name, info.size, fault, partial(archive.extractfile, info) if info.isreg() else None
    # tarfile takes a cut between two members, or a damaged header, for the end; a whole tar ends in zeros.
    archive.fileobj.seek(archive.offset)
    if archive.fileobj.read(tarfile.BLOCKSIZE) != bytes(tarfile.BLOCKSIZE):
        raise tarfile.ReadError("no end marker")
    while rest := archive.fileobj.read(1 << 20):  # read on to the end, where gzip keeps the checksum of all
        yield "what follows the members", len(rest), "", None
