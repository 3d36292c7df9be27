"""Loops that numba compiles, which is imported when the first of them is called."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import Any, ClassVar

NOTICE = "compiling loops, which takes up to half a minute; later calls load what is kept of them"
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


class Loop:
    """A compiled function of arrays and numbers; `py_func` is what was written."""

    announced: ClassVar[bool] = False  # whether the next compilation is told

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        update_wrapper(self, function)
        self.py_func, self._options = function, options

    def __call__(self, *arguments: Any) -> Any:
        """Run the loop."""
        return self.dispatcher(*arguments)

    @cached_property
    def dispatcher(self) -> Any:
        """What numba makes of the function."""
        from gpca.process import numba_cache

        if self._options.get("parallel"):
            self.py_func.__globals__["prange"] = numba_cache.prange
        return numba_cache.njit(**self._options)(self.py_func)


def njit(**options: Any) -> Callable[[Callable[..., Any]], Loop]:
    """Return a decorator that makes a loop of a function, by options of numba's decorator of that name."""
    return lambda function: Loop(function, options)


def say_when_compiling() -> None:
    """Print one line to stderr when the next loop is compiled rather than loaded."""
    Loop.announced = True
