"""Hold a step to what it promises of bad input: one line, status 2, soon, in little memory, and nothing written.

Each case runs in a process of its own, forked from a server that has loaded the libraries once, so that hundreds of
them take seconds and one that hangs or swallows all memory harms no other.
"""

import contextlib
import io
import multiprocessing
import os
import resource
import time
import traceback
from collections.abc import Sequence
from multiprocessing.connection import Connection
from pathlib import Path

CPU_SECONDS = 10  # of the processor, so that a busy machine fails no test
WALL_SECONDS = 120  # a hang, on the busiest machine
GROWTH_BYTES = 2**30
_SERVER = multiprocessing.get_context("forkserver")
_SERVER.set_forkserver_preload(["tests.hostile", "tests.preloaded"])


def refusal(arguments: Sequence[str | Path], folder: Path, *words: str) -> str:
    """Run a command or a step in `folder`, assert that it refuses as promised, and return its line.

    Args:
        arguments: the words for `tests.steps.by_words.main`; paths may be relative to `folder`.
        folder: the working directory; nothing may be written anywhere below it.
        words: what the line has to name, such as the file, the fault and the remedy.
    """
    from gpca.process.compilation import NOTICE  # which is there or not by what earlier tests have compiled

    before = _content(folder)
    outcome = _run([str(argument) for argument in arguments], folder)
    stderr, stdout = outcome["stderr"], outcome["stdout"]
    assert outcome["status"] == 2, f"status {outcome['status']}: {stderr}{stdout}"
    lines = [line for line in stderr.splitlines() if not line.startswith(NOTICE)]
    assert len(lines) == 1, f"more than one line: {stderr}"
    assert not stdout, f"something on stdout: {stdout}"
    assert outcome["cpu_seconds"] < CPU_SECONDS, f"took {outcome['cpu_seconds']:.0f} s of the processor: {stderr}"
    assert outcome["growth_bytes"] < GROWTH_BYTES, f"took {outcome['growth_bytes'] / 2**20:.0f} MB: {stderr}"
    assert _content(folder) == before, "wrote something"
    for word in words:
        assert word in stderr, f"does not say {word!r}: {stderr}"
    return stderr


def _run(arguments: list[str], folder: Path) -> dict:
    receiver, sender = _SERVER.Pipe(duplex=False)
    process = _SERVER.Process(target=_child, args=(arguments, str(folder), dict(os.environ), sender))
    process.start()
    sender.close()
    try:
        assert receiver.poll(WALL_SECONDS), f"still running after {WALL_SECONDS} s: gpca {' '.join(arguments)}"
        return receiver.recv()
    except EOFError:
        process.join()
        raise AssertionError(f"died with status {process.exitcode}: gpca {' '.join(arguments)}") from None
    finally:
        process.kill()
        process.join()


def _child(arguments: list[str], folder: str, environment: dict[str, str], sender: Connection) -> None:
    from tests.steps.by_words import main

    os.chdir(folder)
    os.environ.update(environment)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    limit = pages * resource.getpagesize() + 3 * GROWTH_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    started = time.process_time()
    with contextlib.redirect_stdout(io.StringIO()) as stdout, contextlib.redirect_stderr(io.StringIO()) as stderr:
        try:
            status = main(arguments)
        except SystemExit as fault:
            status = fault.code
        except BaseException:
            status = traceback.format_exc()
    usage = resource.getrusage(resource.RUSAGE_SELF)
    sender.send(
        {
            "status": status,
            "stdout": stdout.getvalue(),
            "stderr": stderr.getvalue(),
            "cpu_seconds": time.process_time() - started,
            "growth_bytes": usage.ru_maxrss * 1024 - peak,
        }
    )


def _content(folder: Path) -> dict[str, tuple[int, int]]:
    """Size and time of change of everything below a folder."""
    return {
        str(path.relative_to(folder)): (path.lstat().st_size, path.lstat().st_mtime_ns) for path in folder.rglob("*")
    }
