"""A kind of source: boxes, whose edges a text file lists in meters, one box in a line."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from gpca.objects.surface import Surface


def from_entry(entry: dict, folder: Path) -> Iterator[Surface]:
    """Yield a surface for each line of ``boxes.txt`` in the location of the config's entry."""
    import trimesh

    for number, line in enumerate((folder / "boxes.txt").read_text("utf-8").splitlines()):
        mesh = trimesh.creation.box([float(word) for word in line.split()])
        yield Surface(f"box {number}", mesh.vertices, mesh.faces)
