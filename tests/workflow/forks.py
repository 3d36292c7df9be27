"""Runs Python in forks of a server that has loaded the libraries once: they take longer to load than most jobs to do.

The suite itself is not loaded: each copy of the project brings its own.
"""

import atexit
import multiprocessing
import os
import runpy
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from multiprocessing.connection import Connection, Listener, wait
from pathlib import Path
from threading import Lock, Thread

WALL_SECONDS = 1200  # a hang, on the busiest machine
_SERVER = multiprocessing.get_context("forkserver")
# A start asks after all processes that run; of an exit code that two threads read at once, one reads that it is lost.
_ONE_READS = Lock()
_SERVER.set_forkserver_preload(["tests.workflow.loaded"])

# Says to the test what it was called with and ends as the fork ends, which writes where this process would.
_PYTHON = """\
#!{python} -IS
import os, sys
from multiprocessing.connection import Client
with Client({address!r}) as test:
    streams = [f"/proc/{{os.getpid()}}/fd/{{n}}" for n in (1, 2)]
    test.send((sys.argv[1:], os.getcwd(), dict(os.environ), streams))
    sys.exit(test.recv())
"""


def run(arguments: Sequence[str], folder: Path, environment: Mapping[str, str]) -> subprocess.CompletedProcess:
    """Run ``python <arguments>`` in `folder`, a module (``-m name …``) or a script; what it runs so is a fork too."""
    environment = {**environment, "PATH": f"{_python().parent}{os.pathsep}{environment['PATH']}"}
    with tempfile.TemporaryDirectory() as kept:
        streams = [Path(kept) / name for name in ("stdout", "stderr")]
        for stream in streams:
            stream.touch()
        code = _fork(arguments, folder, environment, streams)
        return subprocess.CompletedProcess(arguments, code, *(stream.read_text() for stream in streams))


@cache
def _python() -> Path:
    """Return a ``python`` of which every process is a fork, as long as this process lives."""
    folder = Path(tempfile.mkdtemp(prefix="gpca-tests-"))
    atexit.register(shutil.rmtree, folder)
    path, address = folder / "python", f"\0{folder}"  # of Linux: no file is left of it
    path.write_text(_PYTHON.format(python=sys.executable, address=address), encoding="utf-8")
    path.chmod(0o755)
    Thread(target=_serve, args=(Listener(address, backlog=16),), daemon=True).start()
    return path


def _serve(listener: Listener) -> None:
    while True:
        Thread(target=_answer, args=(listener.accept(),), daemon=True).start()


def _answer(asked: Connection) -> None:
    with asked:
        asked.send(_fork(*asked.recv()))


def _fork(arguments, folder, environment, streams) -> int:
    process = _SERVER.Process(target=_child, args=(arguments, folder, environment, streams, _python()))
    with _ONE_READS:
        process.start()
    wait([process.sentinel], WALL_SECONDS)
    with _ONE_READS:
        process.join(0)
        process.kill()
        process.join()
        return process.exitcode


def _child(arguments, folder, environment, streams, python) -> None:
    for descriptor, stream in enumerate(streams, start=1):
        os.dup2(os.open(stream, os.O_WRONLY | os.O_APPEND), descriptor)
    # New ones: those of the server remember whether what they wrote to could be searched.
    sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
    sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.executable = str(python)
    # The interpreter's own, as in a new process: the tests' would bring the suite of this checkout.
    sys.path = [path for path in sys.path if path.startswith((sys.prefix, sys.base_prefix))]
    # So would the modules that a server holds which was started for other tests in this process.
    for name in [name for name in sys.modules if name.partition(".")[0] in ("gpca", "baselines")]:
        del sys.modules[name]
    if arguments[0] == "-m":
        sys.path.insert(0, str(folder))
        sys.argv = list(arguments[1:])
        runpy.run_module(arguments[1], run_name="__main__", alter_sys=True)
    else:
        sys.path.insert(0, str(Path(arguments[0]).parent))
        sys.argv = list(arguments)
        runpy.run_path(arguments[0], run_name="__main__")
