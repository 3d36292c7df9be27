"""Downloads kept in a cache and checked by SHA-256, and archives (zip, tar, tgz) unpacked without trusting them."""

import gzip
import math
import re
import shutil
import stat
import sys
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PureWindowsPath
from typing import IO, Any
from urllib.parse import urlsplit

from gpca.errors import InputError
from gpca.io.files import LARGEST_FILE_BYTES, require_file, sha256_of_file, whole_file, whole_folder

TIMEOUT_S = 30
LARGEST_UNPACKED_BYTES = 20 * 10**9  # the largest archive of the BOP benchmark unpacks to somewhat less
REMEDY = "delete it and fetch it again, or check the url"
_DAMAGE = (tarfile.TarError, zipfile.BadZipFile, gzip.BadGzipFile, EOFError, zlib.error, NotImplementedError)
_TWO_IN_ONE_PLACE = (FileExistsError, IsADirectoryError, NotADirectoryError)  # a member that is a file and a folder


def fetch(url: str, sha256: str | None, folder: str | Path, location: str | None = None) -> Path:
    """Return the file of `url`, from the cache `folder` or downloaded to it; without a `sha256`, its sum is printed.

    A faulty download is removed, but a file that was in the cache stays. `location` is that of the data below data_dir.
    """
    path = cached_path(url, folder)
    if path.is_file():
        _check(path, sha256, url, f"delete {path} to fetch it again or correct sha256 in the config")
        return path
    import pooch
    from requests import exceptions

    print(f"downloading {url} to {path}", file=sys.stderr)
    remedy = f"set data_dir to a folder that contains {location or 'the data'}, or download it by hand to {path}"
    with whole_file(path) as partial_path:
        try:
            download = pooch.HTTPDownloader(progressbar=True, chunk_size=1 << 16, timeout=TIMEOUT_S)
            download(url, str(partial_path), None)
        except exceptions.HTTPError as fault:
            answer = str(fault) if fault.response is None else f"{fault.response.status_code} {fault.response.reason}"
            raise InputError(url, f"cannot be fetched: the server answered {answer}", remedy) from fault
        except (exceptions.ConnectionError, exceptions.Timeout) as fault:
            raise InputError(url, "cannot be reached", remedy) from fault
        except exceptions.RequestException as fault:
            raise InputError(url, f"the transfer was interrupted ({type(fault).__name__})", remedy) from fault
        again = "the download was removed; try again, or correct sha256 in the config"
        actual = _check(partial_path, sha256, url, again)
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
    """Yield the regular files of an archive; InputError for damage, links, devices, ways out of it, or too many bytes.

    The filters of the standard library let links pass, and strip a leading slash in silence.
    """
    path = Path(path)
    require_file(path, "no such file", "check url or files in the config", math.inf)
    with _damage_named(path), path.open("rb") as file:
        magic = file.read(2)
        mode: Any = "r:gz" if magic == b"\x1f\x8b" else "r:"
        archive = zipfile.ZipFile(path) if magic == b"PK" else tarfile.open(path, mode)  # noqa: SIM115
    members, total = [], 0
    with archive:
        with _damage_named(path):
            # One after another: a bomb may have to be decompressed to find the next.
            for name, size, is_file, fault, open_it in _entries(archive):
                relative = PureWindowsPath(name)  # knows both separators and drives: nothing absolute escapes it
                if relative.anchor or ".." in relative.parts:
                    raise InputError(path, f"member '{name}' would leave the folder it is unpacked into", REMEDY)
                if fault:
                    raise InputError(path, f"member '{name}' is {fault}", REMEDY)
                if (total := total + size) > largest_bytes:
                    raise InputError(path, f"would unpack to more than {largest_bytes / 1e9:.3g} GB", REMEDY)
                if is_file:
                    members.append(Member(path, name, size, open_it))
        yield members


def _entries(archive: zipfile.ZipFile | tarfile.TarFile) -> Iterator[tuple[str, int, bool, str, Any]]:
    """Yield name, bytes, whether it is a file, the fault of its kind, and what opens each member."""
    if isinstance(archive, zipfile.ZipFile):
        for info in archive.infolist():
            is_fault = stat.S_ISLNK(info.external_attr >> 16) or info.flag_bits & 1
            fault = "a link or encrypted" if is_fault else ""
            yield info.filename, info.file_size, not info.is_dir(), fault, partial(archive.open, info)
        return
    for member in archive:
        fault = "" if member.isreg() or member.isdir() else "a link or a device"
        yield member.name, member.size, member.isreg(), fault, partial(archive.extractfile, member)
    # tarfile takes a cut between two members, or a damaged header, for the end; a whole tar ends in zeros.
    stream: Any = archive.fileobj
    stream.seek(archive.offset)
    if stream.read(tarfile.BLOCKSIZE) != bytes(tarfile.BLOCKSIZE):
        raise tarfile.ReadError("no end marker")
    while rest := stream.read(1 << 20):  # read on to the end, where gzip keeps the checksum of all
        yield "what follows the members", len(rest), False, "", None


def unpack(path: str | Path, folder: str | Path, largest_bytes: int = LARGEST_UNPACKED_BYTES) -> Path:
    """Unpack an archive into a folder, whole or not at all, unless it is there, and return the folder."""
    folder = Path(folder)
    if folder.is_dir():
        return folder
    with open_archive(path, largest_bytes) as members, whole_folder(folder) as content:
        needed, free = sum(member.size for member in members), shutil.disk_usage(content).free
        if needed > free:
            fault = f"unpacks to {needed / 1e9:.3g} GB, but {free / 1e9:.3g} GB of the disk are free"
            raise InputError(path, fault, f"free some space or keep downloads outside {folder.parent}")
        for member in members:
            target = content / member.name
            with _damage_named(member.archive):
                target.parent.mkdir(parents=True, exist_ok=True)
                with member.open() as stream, target.open("wb") as file:
                    shutil.copyfileobj(stream, file, 1 << 20)
    return folder


@contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    try:
        yield
    except (*_DAMAGE, *_TWO_IN_ONE_PLACE) as fault:
        raise InputError(path, f"is a truncated or damaged archive ({fault})", REMEDY) from fault
