"""Objects drawn by the package itself: stand-ins for real data, needing no file and no download."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module

import numpy as np

from gpca.errors import InputError
from gpca.objects.surface import Surface

FAMILIES = {  # family: the module of gpca.objects.shapes whose OBJECTS maps each name to what draws it
    "coffee_cup": "cups",
    "linemod": "linemod",
    "ycb": "ycb",
}


def surfaces(family: str) -> Iterator[Surface]:
    """Yield the objects of a family as closed meshes in meters, z up, in a fixed order; the same at every call.

    Raises:
        InputError: at the call, for a family that is not one of FAMILIES.
    """
    require_family(family)
    objects = import_module(f"gpca.objects.shapes.{FAMILIES[family]}").OBJECTS
    return (_surface(name, draw()) for name, draw in objects.items())


def require_family(family: str) -> None:
    """Raise an InputError that names the known families unless `family` is one of them."""
    if family not in FAMILIES:
        raise InputError(f"family '{family}'", "no such procedural family", f"choose one of {', '.join(FAMILIES)}")


def _surface(name: str, mesh) -> Surface:
    return Surface(name, np.array(mesh.vertices, np.float64), np.array(mesh.faces, np.int64))
