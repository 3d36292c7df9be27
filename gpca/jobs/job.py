"""A job of the workflow: what its rule gives a step or a script, how it runs, prints and ends."""

import ctypes
import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TextIO

from gpca.errors import InputError
from gpca.process.environment import missing
from gpca.process.plugins import place_in_plugin
from gpca.process.processor import prepare
from gpca.process.progress import certain_interrupts


class Job:
    """The files, names and settings that a rule gives a step, as attributes."""

    def __init__(self, **given: Any) -> None:
        self.__dict__.update(given)

    def get(self, name: str, default: Any = None) -> Any:
        """Return what the rule gives by that name, or the default where it is missing or empty."""
        value = self.__dict__.get(name)
        return default if value in (None, "", []) else value

    @property
    def axes(self) -> tuple[str, int]:
        """Source and seed."""
        return self.source, self.seed

    def section(self, name: str) -> dict[str, Any]:
        """Return a part of ``settings``, empty where it is absent or null."""
        return self.settings.get(name) or {}

    def by_name(self, section: str, names: Iterable[str]) -> dict[str, dict]:
        """Return name -> its settings in a part of ``settings``, empty where absent."""
        return {name: self.section(section).get(name) or {} for name in names}

    def settings_and_icp(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return ``settings`` without ``icp``, and ``icp``."""
        settings = dict(self.settings)
        return settings, settings.pop("icp", {})

    def files(self, name: str) -> list[Path]:
        """Return the files of that name as a list."""
        files = getattr(self, name)
        return files if isinstance(files, list) else [files]

    def per_seed(self, *names: str) -> Iterator[tuple]:
        """Yield each of ``seeds`` with its files in the named lists."""
        return zip(self.seeds, *(getattr(self, name) for name in names), strict=True)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"the rule of this job gives no '{name}'")


def run_step(snakemake: Any) -> None:
    """Run the step that the rule names in ``params.step``, stderr in the rule's log, then exit; see :func:`call`."""
    names = {"threads": snakemake.threads} | dict(snakemake.wildcards.items()) | dict(snakemake.params.items())
    prepare(names["threads"])  # before NumPy, torch and numba are loaded
    keep_freed_memory()
    _print_to(snakemake.log)
    step = names.pop("step")
    names |= {"seed": int(names["seed"])} if "seed" in names else {}
    names["settings"] = json.loads(names.get("settings", "{}"))
    folders = names.pop("folders", {})
    names |= {"data_dir": folders.get("data_dir"), "downloads": Path(folders.get("downloads") or "")}
    job = Job(**names, **files_by_name(snakemake.input), **files_by_name(snakemake.output))
    sys.exit(as_process(step, lambda: call(step, job)))


def call(step: str, job: Job) -> None:
    """Run a step, ``module:function`` or a module with a function ``run``, with torch on the threads of the job."""
    module, _, function = step.partition(":")
    run = getattr(import_module(module), function or "run")
    if "torch" in sys.modules:
        sys.modules["torch"].set_num_threads(job.threads)
    run(job)


@contextmanager
def workflow_script(snakemake: Any) -> Iterator[dict]:
    """Run the block as a script of the workflow: stderr in the log, provenance, which it can add to, beside outputs."""
    from gpca.jobs.provenance import record_provenance

    _print_to(snakemake.log)
    lists = (paths if isinstance(paths, list) else [paths] for paths in files_by_name(snakemake.input).values())
    data = [path for paths in lists for path in paths]
    parameters = {name: value for name, value in snakemake.params.items() if isinstance(name, str)}
    with _as_process() as process, record_provenance(list(snakemake.output), data, parameters) as added:
        yield added
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
    if logs:
        os.dup2(os.open(logs[0], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666), sys.stderr.fileno())


def as_process(name: str, function: Callable[[], int | None]) -> int:
    """Call a function and return the status of the process; a fault of the input is one line and 2, Ctrl-C 130."""
    with _as_process(f"{name}: ") as process:
        process.status = function() or 0
    return process.status


@contextmanager
def _as_process(prefix: str = "") -> Iterator[SimpleNamespace]:
    """Give the block a `status` to set; faults that end in one line set it."""
    process, begun, line = SimpleNamespace(status=0), False, None
    try:
        with certain_interrupts(), standard_streams():
            begun = True
            yield process
    except KeyboardInterrupt:
        line, process.status = "stopped; repeat the command to continue", 130
    except MemoryError:
        line, process.status = "this machine ran out of memory; use smaller settings or another machine", 2
    except (Exception, SystemExit) as fault:
        line, process.status = str(fault) if isinstance(fault, InputError) else place_in_plugin(fault), 2
        if line is None and isinstance(fault, OSError | ModuleNotFoundError):
            line = str(fault) if isinstance(fault, OSError) else missing(fault)
        if line is None:
            raise
    if line is not None:
        say(f"{prefix}{line}")
    if not begun:  # the streams themselves are at fault
        sys.exit(process.status)


def keep_freed_memory() -> None:
    """Let glibc keep freed memory: page faults of large tensors take an eighth of the training otherwise."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # absent outside glibc
    if mallopt is not None:
        trim_threshold, mmap_threshold = -1, -3  # M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of malloc.h
        mallopt(trim_threshold, 2**31 - 1)
        mallopt(mmap_threshold, 2**30)


@contextmanager
def standard_streams() -> Iterator[None]:
    """Print letters that the encoding lacks as escapes such as ``\\xb0``, and check that all output was written."""
    if sys.stdout is None:
        raise InputError("stdout", "is closed", "redirect it, for example to /dev/null")
    if sys.stderr is None:  # its text would be printed to stdout
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    try:
        yield
    except BrokenPipeError as fault:
        raise _unwritable(fault) from fault
    finally:
        try:
            sys.stdout.flush()
        except OSError as fault:
            _discard(sys.stdout)
            raise _unwritable(fault) from fault
        except ValueError as fault:  # code from outside has closed it
            raise InputError("stdout", "has been closed", "leave it open") from fault


def _unwritable(fault: OSError) -> InputError:
    return InputError("stdout", f"cannot be written ({fault.strerror})", "redirect it to a file")


def say(line: str) -> None:
    """Print a line to stderr, ignoring a failure."""
    try:
        print(line, file=sys.stderr, flush=True)
    except OSError:
        _discard(sys.stderr)


def _discard(stream: TextIO) -> None:
    """Drop the buffer of a stream, which Python would flush at its end with another message."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
