"""Lets the same command resume a run that was killed: its leftovers are cleared once none of its processes lives.

Snakemake locks its working directory by files that outlive it: after ``kill -9`` or a power cut every start ends with a
LockException until ``--unlock``. So each Snakemake also holds a lock that the kernel takes back, whatever ends it.
"""

from __future__ import annotations

import fcntl
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import IO

LEFT = ("locks", "scripts/*", "shadow/*", "shell_tmp.*")  # by a killed Snakemake in its own folder
_held: list[IO[str]] = []  # until this process ends


def clear_leftovers(temporary: Sequence[str | Path], main: bool = True, folder: str | Path = ".snakemake") -> None:
    """Note that a Snakemake lives in the working directory; if it is the only one, clear what dead ones have left.

    All that live share a lock of ``running`` in `folder`, so a process that gets it exclusively is alone. Only then
    are Snakemake's own locks removed, never those of another Snakemake. On a file system without such locks nothing is
    known, and nothing is done.

    Args:
        temporary: the folders that this Snakemake has made elsewhere, which it removes unless it is killed.
        main: whether it runs the workflow; one that another has started for a job, as on a cluster, clears nothing.
        folder: where Snakemake keeps its state.
    """
    own, folder = [Path(path).absolute() for path in temporary], Path(folder)
    try:
        folder.mkdir(exist_ok=True)
        file = (folder / "running").open("a+", encoding="utf-8")
    except OSError:  # not writable: Snakemake says so itself
        return
    try:
        if main and _is_alone(file):
            file.seek(0)
            _clear(folder, file.read().splitlines(), own)
            file.truncate(0)
        if main:
            file.writelines(f"{path}\n" for path in own)
            file.flush()
        fcntl.flock(file, fcntl.LOCK_SH)
    except OSError:  # no locks on this file system
        file.close()
    else:
        _held.append(file)


def _is_alone(file: IO[str]) -> bool:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _clear(folder: Path, recorded: list[str], own: list[Path]) -> None:
    left = [path for pattern in LEFT for path in folder.glob(pattern)]
    # Whatever stands in the file, nothing but a sibling of an own folder goes, named as tempfile names them.
    kinds = {(path.parent, path.name[:-8], len(path.name)) for path in own}
    named = [path for path in map(Path, recorded) if (path.parent, path.name[:-8], len(path.name)) in kinds]
    for path in [*left, *named]:
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
