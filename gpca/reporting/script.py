"""What every collecting and drawing script of the workflow does around its one call."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, redirect_stderr
from pathlib import Path

from gpca.errors import InputError


@contextmanager
def logged(log: Sequence[str]) -> Iterator[None]:
    """Send stderr to the first file of `log`, if there is one; an InputError ends as its one line and status 2."""
    with ExitStack() as stack:
        if log:
            Path(log[0]).parent.mkdir(parents=True, exist_ok=True)
            stack.enter_context(redirect_stderr(stack.enter_context(Path(log[0]).open("w", encoding="utf-8"))))
        try:
            yield
        except InputError as fault:
            print(fault, file=sys.stderr)
            sys.exit(2)
