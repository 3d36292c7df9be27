"""Progress of long work on stderr, so that stdout stays clean."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from typing import TypeVar

Item = TypeVar("Item")


def progress(items: Iterable[Item], title: str, **options) -> Iterator[Item]:
    """Iterate with a progress bar on a terminal, and with a line every ten seconds in a log file.

    What ends before the first of them leaves none: a fault that is found at once is the only line.
    """
    from tqdm import tqdm

    interval_s = 0.2 if sys.stderr.isatty() else 10.0
    return tqdm(items, desc=title, file=sys.stderr, mininterval=interval_s, delay=interval_s, **options)
