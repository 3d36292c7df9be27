"""Loops in machine code: of a library that is compiled ahead of time, else of numba, imported at the first such call.

:mod:`gpca.process.build_loops` makes the library. It holds the loops for one signature each, with the bits of numba's
code, and is used where its sources are those of this package and the processor has its instructions.
"""

import ctypes
import hashlib
import sys
from collections.abc import Callable
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from gpca.process.processor import has_threads, may_pin

NOTICE = "compiling loops, which takes up to half a minute; later calls load what is kept of them"
REMEDY = "; 'python -m gpca.process.build_loops' compiles most of them once and for all"
LIBRARY = Path(__file__).with_name("loops.so")
MODULES = (  # of the loops that are compiled ahead of time; they need nothing but each other
    "gpca.alignment.icp_kernels",
    "gpca.encoders.edge_kernels",
    "gpca.reenactment.mixture_kernels",
    "gpca.reenactment.surface_kernels",
)
# Without numba's reference counting (`_nrt`), which takes longer than the search in the loops of ICP, as it counts for
# every array taken out of a tuple. Such functions cannot allocate arrays.
INNER_LOOP: dict[str, Any] = {
    "cache": True,
    "_nrt": False,
    "error_model": "numpy",
    "fastmath": {"contract", "nsz", "nnan", "reassoc"},
}
# Parallel loops over clouds; without "reassoc", so that sums keep their order.
OVER_CLOUDS: dict[str, Any] = {
    "cache": True,
    "parallel": True,
    "error_model": "numpy",
    "fastmath": {"contract", "nsz", "nnan"},
}
prange = range  # until numba is there
_CODES: dict[type, str] = {bool: "?", int: "l", float: "d", np.float64: "d"}
_RESULTS = (ctypes.c_void_p * 2)()  # where machine code writes None and errors


class Loop:
    """A compiled function; `py_func` is what was written, `ahead` the types that :func:`njit` was given."""

    announced: ClassVar[bool] = False  # whether numba's next compilation prints a line

    def __init__(self, function: Callable[..., Any], ahead: str, options: dict[str, Any]) -> None:
        update_wrapper(self, function)
        self.py_func, self.ahead, self.options = function, ahead, options
        self.symbol = f"{function.__module__}.{function.__name__}"

    def __call__(self, *arguments: Any) -> Any:
        """Run the loop."""
        if self._machine_code is not None:
            numbers: list[Any] = [ctypes.addressof(_RESULTS), ctypes.addressof(_RESULTS) + 8]
            if " ".join([_unfold(argument, numbers) for argument in arguments]) == self.ahead:
                return self._run(numbers)
        return self.dispatcher(*arguments)

    def _run(self, numbers: list[Any]) -> None:
        code = self._machine_code
        if not code.argtypes:
            code.argtypes = [ctypes.c_double if isinstance(n, float) else ctypes.c_int64 for n in numbers]
        if code(*numbers):
            raise RuntimeError(f"{self.symbol} failed, as for want of memory or in a division by zero")

    @cached_property
    def _machine_code(self) -> Any:
        loops = library() if self.ahead and not (self.options.get("parallel") and has_threads()) else None
        return loops and loops[self.symbol]

    @cached_property
    def dispatcher(self) -> Any:
        """What numba makes of the function; for one thread, in half the time and with the same bits."""
        options = dict(self.options)
        if options.get("parallel"):
            self.py_func.__globals__["prange"] = numba().prange
            options["parallel"] = has_threads()
        return numba().njit(**options)(self.py_func)


def njit(ahead: str = "", **options: Any) -> Callable[[Callable[..., Any]], Loop]:
    """Return a decorator that makes a loop of a function, by options of numba's decorator of that name.

    Args:
        ahead: for machine code ahead of time, of a function that returns nothing: NumPy's letters of the arguments'
            types, an array's with the number of its axes, as in "d2 l d"; those of a tuple's fields in "( ... )".
        options: of numba.
    """
    return lambda function: Loop(function, ahead, options)


def _unfold(argument: Any, numbers: list[Any]) -> str:
    """Append what numba's machine code is given of an argument; return its type, "" where it has no such code."""
    if isinstance(argument, tuple):
        return f"( {' '.join([_unfold(field, numbers) for field in argument])} )"
    if isinstance(argument, np.ndarray) and argument.flags.c_contiguous and argument.dtype.isnative:
        data = argument.ctypes.data
        numbers += (0, 0, argument.size, argument.itemsize, data, *argument.shape, *argument.strides)
        return f"{argument.dtype.char}{argument.ndim}"
    numbers.append(argument)
    return _CODES.get(type(argument), "")


@cache
def library() -> ctypes.PyDLL | None:
    """Return the library, None where it is missing, of other sources, or for another processor."""
    try:
        loops = ctypes.PyDLL(str(LIBRARY)) if may_pin() else None
    except OSError:
        return None
    return loops if loops and ctypes.c_char_p.in_dll(loops, "state").value == state().encode() else None


def state() -> str:
    """Return the SHA-256 of the sources of the library."""
    package = Path(__file__).parents[2]
    files = [package.joinpath(*module.split(".")).with_suffix(".py") for module in MODULES]
    files += [Path(__file__), Path(__file__).with_name("build_loops.py")]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


@cache
def numba() -> ModuleType:
    """Return numba with our cache, to which loops in other loops are what it makes of them."""
    from gpca.process import numba_cache

    numba_cache.typeof_impl.register(Loop)(lambda loop, _: numba_cache.types.Dispatcher(loop.dispatcher))
    numba_cache.register("numba:compile", numba_cache.Compilations(_announce))
    return numba_cache


def say_when_compiling() -> None:
    """Print one line to stderr when the next loop is compiled rather than loaded."""
    Loop.announced = True


def _announce() -> None:
    if Loop.announced:
        print(NOTICE + (REMEDY if may_pin() and not library() else ""), file=sys.stderr, flush=True)
    Loop.announced = False
