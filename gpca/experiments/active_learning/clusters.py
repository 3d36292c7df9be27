"""Of how many families of objects the test samples are, where files of accuracies do not tell."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import numpy as np

from gpca.causes.dataset import Causes
from gpca.pairs.dataset import Registrations
from gpca.seeds import seed_of_file

Clusters = Mapping[tuple[str, int], int]  # (source, seed) -> how many


def of_registrations(files: Iterable[str | Path]) -> Clusters:
    """Return how many families the test samples of files named ``…/{source}/seed{seed}.npz`` are of.

    Raises:
        InputError: a file that cannot be read, or of another source or seed.
    """
    return _counted(files, Registrations.load)


def of_causes(files: Iterable[str | Path]) -> Clusters:
    """Return the same of registrations with measured causes."""
    return _counted(files, lambda path, axes: Causes.load(path, axes).registrations)


def _counted(files: Iterable[str | Path], load: Callable[[Path, tuple[str, int]], Registrations]) -> Clusters:
    counts = {}
    for path in map(Path, files):
        axes = path.parent.name, seed_of_file(path)
        registrations = load(path, axes)
        counts[axes] = len(np.unique(registrations.cluster[registrations.rows("test")]))
    return counts
