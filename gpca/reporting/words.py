"""Writes numbers and names as words, the same way in every table and figure."""

from __future__ import annotations

import re


def plural(count: int | str, noun: str) -> str:
    """Return e.g. ``1 seed``, ``5 seeds`` or ``2 to 3 seeds``."""
    return f"{count} {noun}" if str(count) == "1" else f"{count} {noun}s"


def in_words(name: object) -> str:
    """Return a name from a file or a config as words: ``coffee cup`` for ``coffee_cup``."""
    return str(name).replace("_", " ")


def object_of_frames(name: object) -> str:
    """Return what a reader calls an object of depth frames, whose files name it by dataset and model.

    ``master chef can`` for ``scenes 002_master_chef_can``; a number alone says nothing without its dataset, so that it
    is ``object 6 of lmo`` for ``lmo obj_000006``.
    """
    dataset, _, model = str(name).partition(" ")
    if numbered := re.fullmatch(r"obj_0*(\d+)", model):
        return f"object {numbered[1]} of {dataset}"
    return in_words(re.sub(r"^\d+_", "", model or dataset))
