"""Ctrl-C that is certain, also where the interpreter swallows it or a library turns it into another error.

Python raises KeyboardInterrupt wherever it happens to be. Inside a callback of compiled code (as llvmlite has them for
numba's compiler), a ``__del__`` or a weakref callback, it prints "Exception ignored in" and goes on; numba raises a
SystemError instead. So the signal is also remembered, and :func:`raise_if_interrupted` raises it again.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

_interrupted = False


@contextmanager
def certain_interrupts() -> Iterator[None]:
    """Let the block end with KeyboardInterrupt if Ctrl-C falls into it, whatever became of the exception then.

    Where SIGINT is ignored, as in the background of a shell, or handled by somebody else, the block runs as it would
    without.
    """
    global _interrupted
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    _interrupted = False
    signal.signal(signal.SIGINT, _remember_and_raise)
    try:
        yield
        raise_if_interrupted()
    except Exception as fault:
        if _interrupted:
            raise KeyboardInterrupt from fault
        raise
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        _interrupted = False


def raise_if_interrupted() -> None:
    """Raise KeyboardInterrupt if Ctrl-C has fallen into the block of :func:`certain_interrupts`."""
    if _interrupted:
        raise KeyboardInterrupt


def _remember_and_raise(number: int, frame: object) -> None:
    global _interrupted
    _interrupted = True
    raise KeyboardInterrupt
