"""Registrations that explanations have queued for a person, in a file that grows; ``gpca label`` asks about them."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.io.arrays import REAL, TEXT, WHOLE, load_arrays, save_arrays
from gpca.model.scene import Scene
from gpca.pairs.dataset import ragged

VERSION = 1  # of the file; also what tells it from registrations of a run
MARK = "queued"
LONGEST_NAME = 200  # letters
OF_ROW = ("cloud", "target")


@dataclass(frozen=True)
class Queue:
    """S registrations without labels, in the canonical frames and the diameters of their targets.

    Attributes:
        object_name: (S,) the files, as ``source to target``.
        h: (S, d) embedding of each aligned source.
        points, offsets, target_points, target_offsets: the clouds, as :class:`gpca.pairs.dataset.Registrations` has
            them.
    """

    object_name: np.ndarray
    h: np.ndarray
    points: np.ndarray
    offsets: np.ndarray
    target_points: np.ndarray
    target_offsets: np.ndarray

    def __len__(self) -> int:
        return len(self.object_name)

    def cloud(self, i: int) -> np.ndarray:
        """Return the aligned source cloud (P, 3) of row i."""
        return self.points[self.offsets[i] : self.offsets[i + 1]]

    def target(self, i: int) -> np.ndarray:
        """Return the target cloud (Q, 3) of row i."""
        return self.target_points[self.target_offsets[i] : self.target_offsets[i + 1]]

    def save(self, path: str | Path) -> None:
        """Write the npz."""
        arrays = {each.name: getattr(self, each.name) for each in fields(self)}
        save_arrays(path, arrays | {MARK: np.array(VERSION)})

    @classmethod
    def load(cls, path: str | Path) -> Queue:
        """Read the npz.

        Raises:
            InputError: missing, damaged, or clouds that do not fit their offsets.
        """
        shapes: dict[str, tuple[int | str, ...]] = {"object_name": ("S",), "h": ("S", "d"), "points": ("P", 3)}
        shapes |= {"target_points": ("Q", 3), "offsets": ("O",), "target_offsets": ("O",), MARK: ()}
        kinds = dict.fromkeys(shapes, REAL) | {"object_name": TEXT}
        kinds |= dict.fromkeys(("offsets", "target_offsets", MARK), WHOLE)
        arrays = load_arrays(path, shapes, kinds)
        arrays.pop(MARK)
        for points, ends in (("points", "offsets"), ("target_points", "target_offsets")):
            offsets = arrays[ends]
            whole = len(offsets) == len(arrays["h"]) + 1 and offsets[0] == 0 and offsets[-1] == len(arrays[points])
            if not whole or (np.diff(offsets) < 1).any():
                raise InputError(path, f"'{ends}' do not match '{points}'", "queue the registrations again")
        return cls(**arrays)


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
    clouds, targets = ([getattr(part, of)(i) for part in (before, one) for i in range(len(part))] for of in OF_ROW)
    both = {name: np.concatenate([getattr(before, name), getattr(one, name)]) for name in ("object_name", "h")}
    replace(one, **both, **ragged(clouds, targets)).save(path)
    return len(before) + 1
