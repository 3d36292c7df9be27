"""Numba, with a folder for what it compiles wherever the modules lie and whoever runs them.

It keeps that beside the modules, else in the user's cache, and does not compile at all where it can write in neither:
in a read-only checkout, say, by a user without a home.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

VARIABLE = "NUMBA_CACHE_DIR"


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

from numba import config, njit, prange  # noqa: E402

setattr(config, "CACHE_DIR", os.environ.get(VARIABLE, ""))  # noqa: B010 - numba declares it at run time; where it was imported before

__all__ = ["njit", "prange"]
