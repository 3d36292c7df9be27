"""What a source is called wherever it is shown: a stand-in always says that it is one."""

from __future__ import annotations

from collections.abc import Mapping

STAND_IN = "procedural stand-in"


def title_of(entry: Mapping) -> str:
    """Return a source's title, with the words that it is a stand-in where it is one."""
    return f"{entry['title']} ({STAND_IN})" if entry["stand_in"] else entry["title"]
