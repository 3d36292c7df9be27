"""Progress of long work on stderr, and Ctrl-C that is not lost.

Inside a callback of compiled code, a ``__del__`` or a weakref callback, Python prints a KeyboardInterrupt and goes
on, and numba raises a SystemError instead. So the signal is also remembered, and raised again by :func:`progress`.
"""

import signal
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

Item = TypeVar("Item")
_interrupted = False


def progress(items: Iterable[Item], title: str, **options) -> Iterator[Item]:
    """Iterate with a progress bar on a terminal, and with a line every ten seconds in a log file."""
    from tqdm import tqdm

    interval_s = 0.2 if sys.stderr.isatty() else 10.0
    for item in tqdm(items, desc=title, file=sys.stderr, mininterval=interval_s, delay=interval_s, **options):
        _raise_if_interrupted()
        yield item


@contextmanager
def certain_interrupts() -> Iterator[None]:
    """End the block with KeyboardInterrupt if Ctrl-C occurs in it, even if that exception was swallowed."""
    global _interrupted
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    _interrupted = False
    signal.signal(signal.SIGINT, _remember_and_raise)
    try:
        yield
        _raise_if_interrupted()
    except Exception as fault:
        if _interrupted:
            raise KeyboardInterrupt from fault
        raise
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        _interrupted = False


def _raise_if_interrupted() -> None:
    if _interrupted:
        raise KeyboardInterrupt


def _remember_and_raise(number: int, frame: object) -> None:
    global _interrupted
    _interrupted = True
    raise KeyboardInterrupt
