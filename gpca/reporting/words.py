"""Words that tables and figures share."""

from __future__ import annotations


def plural(count: int | str, noun: str) -> str:
    """Return e.g. ``1 seed``, ``5 seeds`` or ``2 to 3 seeds``."""
    return f"{count} {noun}" if str(count) == "1" else f"{count} {noun}s"
