"""Writes numbers and names as words, the same way in every table and figure."""

from __future__ import annotations


def plural(count: int | str, noun: str) -> str:
    """Return e.g. ``1 seed``, ``5 seeds`` or ``2 to 3 seeds``."""
    return f"{count} {noun}" if str(count) == "1" else f"{count} {noun}s"


def in_words(name: object) -> str:
    """Return a name from a file or a config as words: ``coffee cup`` for ``coffee_cup``."""
    return str(name).replace("_", " ")
