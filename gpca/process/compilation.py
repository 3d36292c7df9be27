"""Numba, with a folder for what it compiles wherever the modules lie and whoever runs them.

It keeps that beside the modules, else in the user's cache, and does not compile at all where it can write in neither:
in a read-only checkout, say, by a user without a home.

What it keeps of a function is stale, too, once another module that the function's own imports has changed: numba alone
looks at the function's own file, and would go on with what it once took from the others.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from gpca.code_files import code_files

VARIABLE = "NUMBA_CACHE_DIR"
NOTICE = "compiling loops, which takes up to half a minute; later calls load what is kept of them"


def _set_cache_folder() -> None:
    user = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))
    if VARIABLE in os.environ or any(map(_writable, (Path(__file__).parent / "__pycache__", user / "numba"))):
        return
    folder = Path(tempfile.gettempdir(), f"gpca-numba-{os.getuid()}")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        ours = not folder.is_symlink() and folder.stat().st_uid == os.getuid()
    except OSError:
        ours = False
    # What lies there is code that will be run, so a folder that somebody else has made is none to take.
    os.environ[VARIABLE] = str(folder) if ours else tempfile.mkdtemp(prefix="gpca-numba-")


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


_set_cache_folder()  # numba reads the variable when it is imported

import numba  # noqa: E402
from numba import config, prange  # noqa: E402
from numba.core.event import Listener, register  # noqa: E402

setattr(config, "CACHE_DIR", os.environ.get(VARIABLE, ""))  # noqa: B010 - numba declares it at run time; where it was imported before

__all__ = ["INNER_LOOP", "NOTICE", "OVER_CLOUDS", "njit", "prange", "say_when_compiling"]

# Without numba's reference counting (`_nrt`): whenever an array is taken out of a tuple, it counts up and down, which
# in the loops of ICP takes longer than the search. Functions compiled so cannot make arrays; they are given room to
# work.
INNER_LOOP: dict[str, Any] = {
    "cache": True,
    "_nrt": False,
    "error_model": "numpy",
    "fastmath": {"contract", "nsz", "nnan", "reassoc"},
}
# Loops over clouds run in parallel; without "reassoc", so that each sum is made in its written order.
OVER_CLOUDS: dict[str, Any] = {
    "cache": True,
    "parallel": True,
    "error_model": "numpy",
    "fastmath": {"contract", "nsz", "nnan"},
}


def njit(**options: Any) -> Callable[[Callable], Any]:
    """Return numba's decorator with these options; see above for what it keeps."""

    def decorate(function: Callable) -> Any:
        compiled = numba.njit(**options)(function)
        if options.get("cache") and compiled is not function:  # as it is where NUMBA_DISABLE_JIT is set
            # Numba has no public name for it. It is read first, so that a numba which keeps it elsewhere fails here.
            index = compiled._cache._cache_file
            index._source_stamp = (index._source_stamp, _stamp(function.__module__))
        return compiled

    return decorate


@cache
def say_when_compiling() -> None:
    """Print one line to stderr as soon as a loop is compiled, not loaded: a first call takes longer than all others."""
    register("numba:compile", _Notice())


class _Notice(Listener):
    said = False

    def on_start(self, event: object) -> None:
        if not self.said:
            print(NOTICE, file=sys.stderr, flush=True)
        self.said = True

    def on_end(self, event: object) -> None:
        """Others are compiled after the first one."""


@cache
def _stamp(module: str) -> str:
    """Return the SHA-256 of all files that a module's code comes from."""
    return hashlib.sha256(b"".join(Path(file).read_bytes() for file in code_files(module))).hexdigest()
