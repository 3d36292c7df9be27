"""Numba with a cache of loops per state of their code and that of imported modules, which numba does not check."""

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from numba import config, njit, prange, types
from numba.core.event import Listener, register
from numba.extending import typeof_impl

from gpca.process.code_files import ROOT, code_files
from gpca.process.processor import has_threads

__all__ = ["Compilations", "njit", "prange", "register", "typeof_impl", "types"]

VARIABLE = "NUMBA_CACHE_DIR"


def _cache_folder() -> Path:
    loops = [path for path in sorted(ROOT.glob("gpca/**/*.py")) if b"njit" in path.read_bytes()]
    modules = (".".join(path.relative_to(ROOT).with_suffix("").parts) for path in loops)
    code = b"".join(Path(file).read_bytes() for file in code_files(*modules))
    kind = "parallel" if has_threads() else "serial"  # of which numba's own names of loops say nothing
    state = f"loops-{kind}-{hashlib.sha256(code).hexdigest()[:16]}"
    if given := os.environ.get(VARIABLE):  # by the user, or by the parent process with the state
        return (Path(given).parent if Path(given).name.startswith("loops-") else Path(given)) / state
    user = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))
    for folder in (Path(__file__).parent / "__pycache__", user / "gpca"):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder / state
        except OSError:  # not writable
            continue
    return Path(tempfile.mkdtemp(prefix="gpca-numba-")) / state  # for this user alone, as the code in it is run


class Compilations(Listener):
    """Calls a function before each compilation."""

    def __init__(self, before: Callable[[], None]) -> None:
        self._before = before

    def on_start(self, event: object) -> None:
        """Call the function."""
        self._before()

    def on_end(self, event: object) -> None:
        """Do nothing."""


os.environ[VARIABLE] = str(_cache_folder())  # read by numba whenever such a variable has changed, and by children
setattr(config, "CACHE_DIR", os.environ[VARIABLE])  # noqa: B010 - numba may have been imported before
