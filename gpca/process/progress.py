"""Progress of long work on stderr, so that stdout stays clean."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from typing import TypeVar

from gpca.process.interrupts import raise_if_interrupted

Item = TypeVar("Item")


def progress(items: Iterable[Item], title: str, **options) -> Iterator[Item]:
    """Iterate with a progress bar on a terminal, and with a line every ten seconds in a log file.

    Work that ends before the first update shows none, so that a fault that is found at once is the only line.

    Raises:
        KeyboardInterrupt: at the next item, where Ctrl-C was lost meanwhile.
    """
    from tqdm import tqdm

    interval_s = 0.2 if sys.stderr.isatty() else 10.0
    for item in tqdm(items, desc=title, file=sys.stderr, mininterval=interval_s, delay=interval_s, **options):
        raise_if_interrupted()
        yield item
