"""Every step by hand, one after the other, in a folder: ``python -m tests.steps.chain FOLDER`` from the checkout.

Nothing is imported that loads a library: the first step does it, as on the command line.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from gpca.__main__ import main

from .command_lines import STEP_OPTIONS, arguments

# What the command lines leave out: shapes of our own, and explainers that use no network.
OTHERS = (
    ["objects", "--source", "linemod", "--settings", '{"kind": "procedural"}', "--surface-points", "400", "--out",
     "procedural.npz"],
    ["registrations", "--source", "linemod", "--settings", '{"train": 12, "test": 6, "cloud_points": 128}', "--seed",
     "100", "--objects", "procedural.npz", "--out", "others.npz", "--timings", "others.csv"],
)  # fmt: skip


def make_all(folder: Path) -> None:
    """Run every step in `folder`, which must exist."""
    os.chdir(folder)
    for words in OTHERS:
        assert main(list(words)) == 0
    write_inputs(folder)
    for step in STEP_OPTIONS:
        assert main(arguments(step)) == 0


def write_inputs(folder: Path) -> None:
    """Write what a user gives: two meshes and the answers of the one who labels."""
    import trimesh

    (folder / "meshes").mkdir()
    trimesh.creation.box((40, 70, 100)).export(folder / "meshes/brick.stl")
    trimesh.creation.cone(30, 90).export(folder / "meshes/cone.ply")
    (folder / "answers.txt").write_text("overlap\nocclusion\n/skip\n")


if __name__ == "__main__":
    make_all(Path(sys.argv[1]))
