"""Downloads: a file per URL, kept in a cache folder, checked by its SHA-256, whole or not there at all."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from threading import Thread
from time import monotonic
from urllib.parse import urlsplit

from gpca.errors import InputError
from gpca.io.files import sha256_of_file, whole_file

TIMEOUT_S = 30
# A server that sends a byte now and then would keep a run waiting for ever. After a minute a download has to have come
# at 10 kB/s on average, a fifth of what a modem did; the largest that the suite knows of has 15 GB.
GRACE_S, SLOWEST_BYTES_PER_S = 60, 10_000
LARGEST_BYTES = 10**11


def fetch(url: str, sha256: str | None, folder: str | Path, location: str | None = None) -> Path:
    """Return the file of `url`, downloaded when the cache does not hold it yet.

    Args:
        url: http or https.
        sha256: the expected checksum; None accepts any and prints the actual one, so that it can be pinned.
        folder: the cache; the file lies in it under the host and path of the URL, so that no two URLs share a file.
        location: of the same data below data_dir, named in the message when the network fails.

    Raises:
        InputError: no network, an error answer, an interrupted transfer, or another checksum. What was downloaded is
            removed then; a file that was in the cache before stays.
    """
    path = cached_path(url, folder)
    if path.is_file():
        _check(path, sha256, url, f"delete {path} to fetch it again or correct sha256 in the config")
        return path
    print(f"downloading {url} to {path}", file=sys.stderr)
    with whole_file(path) as partial:
        _download(url, partial, _remedy(path, location))
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
    try:
        _within_limits(lambda: download(url, str(path), None), url, path, remedy)
    except requests.exceptions.HTTPError as fault:
        answer = str(fault) if fault.response is None else f"{fault.response.status_code} {fault.response.reason}"
        raise InputError(url, f"cannot be fetched: the server answered {answer}", remedy) from fault
    except (requests.exceptions.ConnectionError, requests.exceptions.Timeout) as fault:
        raise InputError(url, "cannot be reached", remedy) from fault
    except requests.exceptions.RequestException as fault:
        raise InputError(url, f"the transfer was interrupted ({type(fault).__name__})", remedy) from fault


def _within_limits(download: Callable[[], object], url: str, path: Path, remedy: str) -> None:
    """Run a download in a thread and watch the file grow; what it raises is raised here.

    Raises:
        InputError: too slow or too large. The thread is left to itself: it ends with the process.
    """
    faults = []

    def run() -> None:
        try:
            download()
        except BaseException as fault:
            faults.append(fault)

    thread = Thread(target=run, daemon=True)
    started = monotonic()
    thread.start()
    while thread.is_alive():
        thread.join(1)
        size = path.stat().st_size if path.exists() else 0
        if thread.is_alive() and size < SLOWEST_BYTES_PER_S * (monotonic() - started - GRACE_S):
            raise InputError(url, f"sent {size} bytes in {monotonic() - started:.0f} s, which is too slow", remedy)
        if size > LARGEST_BYTES:
            raise InputError(url, f"sends more than {LARGEST_BYTES} bytes", remedy)
    if faults:
        raise faults[0]


def _remedy(path: Path, location: str | None) -> str:
    return f"set data_dir to a folder that contains {location or 'the data'}, or download it by hand to {path}"
