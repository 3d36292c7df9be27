"""Downloads kept in a cache and checked by SHA-256, and archives (zip, tar, tgz) unpacked."""

import math
import re
import shutil
import sys
import tarfile
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from gpca.errors import InputError, refusing
from gpca.io.files import require_file, sha256_of_file, whole_file, whole_folder

TIMEOUT_S = 30
LARGEST_UNPACKED_BYTES = 20 * 10**9  # the largest archive of the BOP benchmark unpacks to somewhat less
REMEDY = "delete it and fetch it again, or check the url"


def fetch(url: str, sha256: str | None, folder: str | Path, location: str | None = None) -> Path:
    """Return the file of `url`, from the cache `folder` or downloaded to it; without a `sha256`, its sum is printed."""
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
        except exceptions.RequestException as fault:
            answer = fault.response
            words = f"the server answered {answer.status_code} {answer.reason}" if answer is not None else repr(fault)
            raise InputError(url, f"cannot be fetched: {words}", remedy) from fault
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


def unpack(path: str | Path, folder: str | Path, largest_bytes: int = LARGEST_UNPACKED_BYTES) -> Path:
    """Unpack an archive into a folder, whole or not at all, unless it is there; InputError if damaged or huge."""
    path, folder = Path(path), Path(folder)
    if folder.is_dir():
        return folder
    require_file(path, "no such file", "check url or files in the config", math.inf)
    damaged = refusing(path, "is a truncated or damaged archive, or holds links or devices ({})", REMEDY)
    with whole_folder(folder) as content, damaged:
        free = shutil.disk_usage(content).free

        def require_room(sizes: Iterable[int]) -> None:  # one after another: a bomb has to be decompressed for the next
            total = 0
            for size in sizes:
                if (total := total + size) > largest_bytes:
                    raise InputError(path, f"would unpack to more than {largest_bytes / 1e9:.3g} GB", REMEDY)
            if total > free:
                fault = f"unpacks to {total / 1e9:.3g} GB, but {free / 1e9:.3g} GB of the disk are free"
                raise InputError(path, fault, f"free some space or keep downloads outside {folder.parent}")

        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                require_room(info.file_size for info in archive.infolist())
                archive.extractall(content)
        else:
            with tarfile.open(path) as members:
                require_room(member.size for member in members)
                members.extractall(content, filter="data")
                # tarfile takes a cut between two members for the end; after it, gzip keeps the checksum of all.
                stream: Any = members.fileobj
                stream.seek(members.offset)
                if stream.read(tarfile.BLOCKSIZE) != bytes(tarfile.BLOCKSIZE):
                    raise tarfile.ReadError("no end marker")
                while stream.read(1 << 20):
                    pass
    return folder
