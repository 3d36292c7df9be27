"""Titles of sources, wherever they are shown: a stand-in always says that it is one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import PurePath

STAND_IN = "procedural stand-in"


def title_of(entry: Mapping) -> str:
    """Return a source's title, with the words that it is a stand-in where it is one."""
    return f"{entry['title']} ({STAND_IN})" if entry["stand_in"] else entry["title"]


def dataset_of(entry: Mapping) -> str:
    """Return the BOP benchmark's name of the dataset that a source's objects are of; empty for other sources."""
    return PurePath(entry.get("location") or "").name if entry.get("kind") == "bop" else ""


def stand_in_clause(entries: Iterable[Mapping], partly: bool = True) -> str:
    """Return the clause that ends a caption when any of its sources is a stand-in, and nothing when none is.

    The clause tells a mixture from stand-ins alone, unless `partly` is false.
    """
    stand_ins = [bool(entry["stand_in"]) for entry in entries]
    if not any(stand_ins):
        return ""
    share = "partly " if partly and not all(stand_ins) else ""
    return f", measured {share}on {STAND_IN}s for the datasets' objects"
