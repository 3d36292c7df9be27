"""The fixed samples of the tracks: kept in a cache, made from the repository's data where they are not, and checked."""

from __future__ import annotations

import hashlib
import os
import shutil
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from gpca.errors import InputError
from gpca.plugins import named
from gpca.tracks.making import make
from gpca.tracks.published import Published, require_clone
from gpca.tracks.track import DEFAULT, Track

LEARNED = ("cause_embeddings", "cause_encoders", "control_embeddings")  # by encoders, whose last digits may differ


@dataclass(frozen=True)
class Samples:
    """The samples of a track.

    Attributes:
        track: of which.
        published: what is known of them, their hashes among it.
        folder: where they are kept, as in the folder of a run; a finished run's own will do.
        processes: so many files are made at a time.
        data_dir: where data is that the repository does not have; None where nothing is.
    """

    track: Track
    published: Published
    folder: Path
    processes: int = 1
    data_dir: Path | None = None

    @classmethod
    def of(
        cls, track: Track, cache: Path | None = None, processes: int | None = None, data_dir: Path | None = None
    ) -> Samples:
        """Return the samples of a track, in the user's cache or another folder."""
        published = Published.load(track)
        return cls(track, published, cache or cache_of(track), processes or os.cpu_count() or 1, data_dir)

    @cached_property
    def config(self) -> dict[str, Any]:
        """The suite's default config, and that of the track's run laid over it, by which samples are made."""
        from gpca.config.check import read
        from gpca.config.layers import read_file, with_defaults

        require_clone(f"track {self.track.name}")
        own = {"plugins": named(), "data_dir": str(self.data_dir) if self.data_dir else None}
        return read(with_defaults(*map(read_file, self.track.layers), own), {})[0]

    def parts(self) -> list[tuple[str, int, np.ndarray]]:
        """Return source, seed and row numbers of the published samples that are kept here or whose data is there."""
        return [part for part in self.published.rows.parts() if self._is_there(*part[:2])]

    def _is_there(self, source: str, seed: int) -> bool:
        if not self.track.may_lack(source) or (self.folder / self.track.file(source, seed)).is_file():
            return True
        from gpca.experiments.scans.experiment import present

        return source in present(self.config)

    def files(self, names: Iterable[str]) -> list[Path]:
        """Return files by their paths below the folder; what is missing is made, and all are checked.

        Raises:
            InputError: a file that is not the one that the published rows were made with, or that cannot be made.
        """
        names = list(names)
        if self.folder == cache_of(self.track) and any(self._fault(name) for name in names):
            shutil.rmtree(self.folder)  # of an earlier version
        if missing := [name for name in names if not (self.folder / name).is_file()]:
            make(missing, self.folder, self.config, self.processes)
        for name in names:
            if fault := self._fault(name):
                remedy = "remove it, and make it with the commit that published them"
                remedy += f", {self.published.commit[:12]}" if self.published.commit else ""
                raise InputError(self.folder / name, fault, remedy)
        return [self.folder / name for name in names]

    def _fault(self, name: str) -> str:
        """Return in what a file differs from what is expected; empty where it does not, or is not there yet."""
        expected, path = self.published.hashes.get(name), self.folder / name
        if expected is None or name.split("/")[0] in LEARNED or not path.is_file():
            return ""
        found = sha256_of_arrays(path)
        if found == expected:
            return ""
        return f"differs from what the published rows were made with ({found[:12]} is not {expected[:12]})"


def cache_of(track: Track) -> Path:
    """Return the folder of the user's in which samples of a track are kept: one for all tracks of the same config."""
    import pooch

    return Path(pooch.os_cache("gpca-bench" if track.run == DEFAULT else f"gpca-bench-{track.run}"))


def sha256_of_arrays(path: str | Path) -> str:
    """Return the hexadecimal SHA-256 of the arrays of an npz, their names, types and shapes, however it is packed.

    Raises:
        InputError: it cannot be read.
    """
    digest = hashlib.sha256()
    try:
        with np.load(path, allow_pickle=False) as arrays:
            for name in sorted(arrays.files):
                array = np.ascontiguousarray(arrays[name])
                digest.update(f"{name}|{array.dtype.str}|{array.shape}|".encode())
                digest.update(array.tobytes())
    except (OSError, ValueError, zipfile.BadZipFile) as fault:
        raise InputError(path, "is not a readable npz archive", "remove it; it is made anew") from fault
    return digest.hexdigest()


def hashes_of(folder: Path, files: Iterable[str]) -> Mapping[str, str]:
    """Return the hash of each file below a folder, by its path there."""
    return {file: sha256_of_arrays(folder / file) for file in files}
