"""The environment that jobs inherit from the process that plans them, and the leftovers of killed runs."""

import fcntl
import json
import os
import shutil
import sys
import sysconfig
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import IO

from gpca.jobs.provenance import CONFIG_VARIABLE, sha256_of_settings
from gpca.process.code_files import ROOT
from gpca.process.processor import pin_instructions

# Sections that change no result: where data lies, and how results are judged.
WITHOUT_RESULT = ("data_dir", "downloads", "comparison", "reference")
LEFTOVERS = ("locks", "scripts/*", "shadow/*", "shell_tmp.*")  # of a killed Snakemake in its folder
_locks: list[IO[str]] = []  # held until this process ends


def export_to_jobs(config: Mapping, source_folder: str | Path = ROOT) -> None:
    """Set environment variables so that jobs run this Python and this code, whatever the working directory.

    PATH begins with this Python's folder, PYTHONPATH with `source_folder` unless Python looks there anyway. Provenance
    records the hashes of the config's sections; libraries are limited to the common instructions.
    """
    sections = {name: sha256_of_settings(value) for name, value in config.items() if name not in WITHOUT_RESULT}
    os.environ[CONFIG_VARIABLE] = json.dumps(sections, sort_keys=True)
    folders = {"PATH": Path(sys.executable).parent}
    source_folder = Path(source_folder).resolve()
    if source_folder not in {Path(sysconfig.get_path(name)).resolve() for name in ("purelib", "platlib")}:
        folders["PYTHONPATH"] = source_folder
    for variable, folder in folders.items():  # once, however often jobs start jobs
        others = [name for name in os.environ.get(variable, "").split(os.pathsep) if name and name != str(folder)]
        os.environ[variable] = os.pathsep.join([str(folder), *others])
    os.environ["PYTHONSAFEPATH"] = "1"
    pin_instructions()


def clear_leftovers(main: bool = True) -> None:
    """Lock the working directory, and clear the leftovers of killed Snakemakes if no other one is running.

    All running Snakemakes share a kernel lock of ``running`` in Snakemake's folder, which ends with them, unlike its
    own locks; one that gets it exclusively is alone. One that is not `main` was started for a job, and clears nothing.
    """
    folder = Path(".snakemake")
    try:
        folder.mkdir(exist_ok=True)
        file = (folder / "running").open("a+", encoding="utf-8")
    except OSError:  # not writable, which Snakemake reports itself
        return
    try:
        if main:
            with suppress(BlockingIOError):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # this one is alone
                for path in (path for pattern in LEFTOVERS for path in folder.glob(pattern)):
                    if path.is_dir() and not path.is_symlink():
                        shutil.rmtree(path, ignore_errors=True)
                    else:
                        path.unlink(missing_ok=True)
        fcntl.flock(file, fcntl.LOCK_SH)
    except OSError:  # no locks on this file system
        file.close()
    else:
        _locks.append(file)
