"""Numba, with a folder for what it compiles: one for each state of the code that the loops come from.

Numba itself looks at a function's own file alone, and would go on with what it once took from other modules. The
folders lie beside this module, else in the user's cache, else among the temporary files: in a read-only checkout, say,
of a user without a home. In them a loop is found by its package, not by its path as numba would, so that a checkout
that was copied or moved takes along what was compiled.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

from gpca.code_files import ROOT, code_files

VARIABLE = "NUMBA_CACHE_DIR"
NOTICE = "compiling loops, which takes up to half a minute; later calls load what is kept of them"


def _cache_folder() -> Path:
    loops = [path for path in sorted(ROOT.glob("gpca/**/*.py")) if b"njit" in path.read_bytes()]
    modules = (".".join(path.relative_to(ROOT).with_suffix("").parts) for path in loops)
    code = b"".join(Path(file).read_bytes() for file in code_files(*modules))
    state = f"loops-{hashlib.sha256(code).hexdigest()[:16]}"
    if named := os.environ.get(VARIABLE):
        return Path(named) if Path(named).name == state else Path(named, state)  # the parent process has named it
    user = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))
    folders = (Path(__file__).parent / "__pycache__", user / "gpca")
    return (next(filter(_writable, folders), None) or _temporary()) / state


def _temporary() -> Path:
    """Return a folder that belongs to this user alone, since the code in it will be run."""
    folder = Path(tempfile.gettempdir(), f"gpca-numba-{os.getuid()}")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        ours = not folder.is_symlink() and folder.stat().st_uid == os.getuid()
    except OSError:
        ours = False
    return folder if ours else Path(tempfile.mkdtemp(prefix="gpca-numba-"))


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


os.environ[VARIABLE] = str(_cache_folder())  # numba reads the variable when it is imported

from numba import config, njit, prange  # noqa: E402
from numba.core.caching import UserProvidedCacheLocator  # noqa: E402
from numba.core.event import Listener, register  # noqa: E402

setattr(config, "CACHE_DIR", os.environ[VARIABLE])  # noqa: B010 - numba declares it at run time; where it was imported before

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


class PackageLocator(UserProvidedCacheLocator):
    """Keeps the loops of a package of ours in a folder of its name."""

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> PackageLocator | None:
        """Return the locator of a function of ours; None for others, which numba keeps as it always does."""
        return super().from_function(py_func, py_file) if Path(py_file).is_relative_to(ROOT) else None

    @classmethod
    def get_suitable_cache_subpath(cls, py_file: str) -> str:
        """Return the name of the package that the file lies in."""
        return ".".join(Path(py_file).relative_to(ROOT).parent.parts)


setattr(config, "CACHE_LOCATOR_CLASSES", f"{__name__}.{PackageLocator.__name__},{UserProvidedCacheLocator.__name__}")  # noqa: B010


@cache
def say_when_compiling() -> None:
    """Print one line to stderr as soon as a loop is compiled, not loaded: a first call takes longer than all others."""
    register("numba:compile", _Notice())


class _Notice(Listener):
    printed = False

    def on_start(self, event: object) -> None:
        if not self.printed:
            print(NOTICE, file=sys.stderr, flush=True)
        self.printed = True

    def on_end(self, event: object) -> None:
        """Do nothing: the line is printed at the start."""
