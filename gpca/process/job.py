"""A job of the workflow: what its rule gives a step or a script, and how that runs and ends."""

from __future__ import annotations

import ctypes
import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from gpca.errors import InputError
from gpca.process.extras import missing
from gpca.process.interrupts import certain_interrupts
from gpca.process.processor import prepare
from gpca.process.standard_streams import say, standard_streams


class Job:
    """The files, names and settings that a rule gives a step, each an attribute by its name in the rule.

    Files are paths, or lists of them where the rule lists them; ``settings`` is a mapping.
    """

    def __init__(self, **given: Any) -> None:
        self.__dict__.update(given)

    def get(self, name: str, default: Any = None) -> Any:
        """Return what the rule gives by that name, or the default where it gives nothing: no file, name or text."""
        value = self.__dict__.get(name)
        return default if value in (None, "", []) else value

    def section(self, name: str) -> dict[str, Any]:
        """Return a part of ``settings``; what is absent or null is empty."""
        return self.settings.get(name) or {}

    def by_name(self, section: str, names: Iterable[str]) -> dict[str, dict]:
        """Return the settings of each of the names in a part of ``settings``; none for those that are not in it."""
        return {name: self.section(section).get(name) or {} for name in names}

    def settings_and_icp(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return ``settings`` without ``icp``, and that part."""
        settings = dict(self.settings)
        return settings, settings.pop("icp", {})

    def files(self, name: str) -> list[Path]:
        """Return the files of that name where a rule may give one or several."""
        files = getattr(self, name)
        return files if isinstance(files, list) else [files]

    def per_seed(self, *names: str) -> Iterator[tuple]:
        """Yield each of ``seeds`` with its file from each of the named lists."""
        return zip(self.seeds, *(getattr(self, name) for name in names), strict=True)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"the rule of this job gives no '{name}'")


def run_step(snakemake: Any) -> None:
    """Run the step that the rule names in ``params.step``, a module with a function ``run(job)``; then exit.

    What the step and its libraries print to stderr goes to the rule's log. A fault of the input ends as one line there
    and status 2.

    Args:
        snakemake: the object that Snakemake gives a script; the input ``code`` is no data.
    """
    names = {"threads": snakemake.threads} | dict(snakemake.wildcards.items()) | dict(snakemake.params.items())
    prepare(names["threads"])  # before NumPy, torch and numba are loaded
    keep_freed_memory()
    _print_to(snakemake.log)
    module = names.pop("step")
    names |= {"seed": int(names["seed"])} if "seed" in names else {}
    names["settings"] = json.loads(names.get("settings", "{}"))
    folders = names.pop("folders", {})
    names |= {"data_dir": folders.get("data_dir"), "downloads": Path(folders.get("downloads") or "")}
    job = Job(**names, **files_by_name(snakemake.input), **files_by_name(snakemake.output))
    sys.exit(as_process(module, lambda: call(module, job)))


def call(step: str, job: Job) -> None:
    """Run a step: the module of that name, with torch on as many threads as the job has."""
    module = import_module(step)
    if "torch" in sys.modules:
        sys.modules["torch"].set_num_threads(job.threads)
    module.run(job)


@contextmanager
def workflow_script(snakemake: Any) -> Iterator[None]:
    """Run the block as a script of the workflow: stderr in the rule's log, provenance beside the outputs.

    A fault of the input ends as one line in the log and status 2.

    Args:
        snakemake: the object that Snakemake gives a script; the input ``code`` is no data.
    """
    from gpca.process.provenance import record_provenance

    _print_to(snakemake.log)
    lists = (paths if isinstance(paths, list) else [paths] for paths in files_by_name(snakemake.input).values())
    data = [path for paths in lists for path in paths]
    parameters = {name: value for name, value in snakemake.params.items() if isinstance(name, str)}
    with _as_process() as process, record_provenance(list(snakemake.output), data, parameters):
        yield
    if process.status:
        sys.exit(process.status)


def files_by_name(files: Any) -> dict[str, Path | list[Path]]:
    """Return the inputs or outputs of a rule by name, a path or a list of them each, without ``code``."""
    return {
        name: Path(value) if isinstance(value, str) else [Path(path) for path in value]
        for name, value in files.items()
        if name != "code"
    }


def _print_to(logs: Any) -> None:
    """Let what the process and its libraries print to stderr go to the rule's log, if it has one."""
    if logs:
        os.dup2(os.open(logs[0], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666), sys.stderr.fileno())


def as_process(name: str, function: Callable[[], int | None]) -> int:
    """Call a function and return the status of the process: 0, or what the function returns.

    A fault of the input ends as one line on stderr and status 2, and so does the lack of a package that
    an extra installs; Ctrl-C as status 130.
    """
    with _as_process(f"{name}: ") as process:
        process.status = function() or 0
    return process.status


@contextmanager
def _as_process(prefix: str = "") -> Iterator[SimpleNamespace]:
    """Give the block a `status` to set; the faults that end in one line set it themselves."""
    process, begun = SimpleNamespace(status=0), False
    try:
        with certain_interrupts(), standard_streams():
            begun = True
            yield process
    except (InputError, OSError) as fault:
        say(f"{prefix}{fault}")
        process.status = 2
    except ModuleNotFoundError as fault:
        if (line := missing(fault)) is None:
            raise
        say(f"{prefix}{line}")
        process.status = 2
    except MemoryError:
        say(f"{prefix}this machine ran out of memory; use smaller settings or another machine")
        process.status = 2
    except KeyboardInterrupt:
        say(f"{prefix}stopped; repeat the command to continue")
        process.status = 130
    if not begun:  # the streams themselves are at fault
        sys.exit(process.status)


def keep_freed_memory() -> None:
    """Let glibc keep what is freed: else every large tensor's pages are faulted in anew, an eighth of training."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # absent outside glibc
    if mallopt is not None:
        trim_threshold, mmap_threshold = -1, -3  # M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of malloc.h
        mallopt(trim_threshold, 2**31 - 1)
        mallopt(mmap_threshold, 2**30)
