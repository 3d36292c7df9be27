"""Names of views: clouds of one instance from several sides, as RGB-D datasets have them."""

from __future__ import annotations

import re


def instance_of(name: str) -> str:
    """Return the instance that a view is of, by its name; a name of another form is an instance of its own."""
    return view_order(name)[0]


def view_order(name: str) -> tuple[str, int, int]:
    """Return instance, sequence and frame of a name such as ``coffee_mug_1_2_14``; else the name itself, 0 and 0."""
    match = re.fullmatch(r"(.+)_([0-9]+)_([0-9]+)", name)
    return (match[1], int(match[2]), int(match[3])) if match else (name, 0, 0)
