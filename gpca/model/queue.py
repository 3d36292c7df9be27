"""Registrations that explanations have queued for a person, in a file that grows; ``gpca label`` asks about them."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from gpca.errors import InputError
from gpca.io.arrays import TEXT, WHOLE, save_arrays
from gpca.io.container import Container, array
from gpca.io.names import Axes
from gpca.model.scene import Scene
from gpca.pairs.dataset import ragged

VERSION = 1  # of the file; also what tells it from registrations of a run
MARK = "queued"
LONGEST_NAME = 200  # letters


@dataclass(frozen=True)
class Queue(Container):
    """S registrations without labels, in the canonical frames and the diameters of their targets.

    Attributes:
        object_name: (S,) the files, as ``source to target``.
        h: (S, d) embedding of each aligned source.
        points, offsets, target_points, target_offsets: the clouds, as :class:`gpca.pairs.dataset.Registrations` has
            them.
    """

    remedy: ClassVar[str] = "queue the registrations again"

    object_name: np.ndarray = array("S", TEXT)
    h: np.ndarray = array("S d")
    points: np.ndarray = array("P 3", offsets="offsets")
    offsets: np.ndarray = array("S+1", WHOLE)
    target_points: np.ndarray = array("Q 3", offsets="target_offsets")
    target_offsets: np.ndarray = array("S+1", WHOLE)

    def cloud(self, i: int) -> np.ndarray:
        """Return the aligned source cloud (P, 3) of row i."""
        return self.part("points", i)

    def target(self, i: int) -> np.ndarray:
        """Return the target cloud (Q, 3) of row i."""
        return self.part("target_points", i)

    def save(self, path: str | Path, axes: Axes | None = None) -> None:
        """Write the npz, marked as a queue."""
        save_arrays(path, self.arrays | {MARK: np.array(VERSION)}, axes)


def is_queue(path: str | Path) -> bool:
    """Return whether a file is a queue, and no registrations of a run."""
    try:
        with zipfile.ZipFile(path) as archive:
            return f"{MARK}.npy" in archive.namelist()
    except (OSError, zipfile.BadZipFile):
        return False


def add_to_queue(path: str | Path, scene: Scene, h_1_d: np.ndarray, name: str) -> int:
    """Add one registration to a file, which need not exist yet, and return how many it then holds.

    Args:
        h_1_d: (1, d) embedding of the aligned source (:meth:`gpca.model.explainer.Explainer.embed`).
        name: of what was registered, in one line.

    Raises:
        InputError: a file that is no queue, or one of another encoder.
    """
    path = Path(path)
    one = Queue(
        object_name=np.array([" ".join(name.split())[-LONGEST_NAME:]]),
        h=h_1_d.astype(np.float32),
        **ragged([scene.aligned.astype(np.float32)], [scene.target.astype(np.float32)]),
    )
    if not path.exists():
        one.save(path)
        return 1
    if not is_queue(path):
        raise InputError(path, "is not a queue", "name another file with --queue")
    before = Queue.load(path)
    if before.h.shape[1] != one.h.shape[1]:
        raise InputError(path, "is a queue of another model", "name another file with --queue")
    Queue.joined([before, one]).save(path)
    return len(before) + 1
