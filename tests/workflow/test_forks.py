"""The forks in which the tests of this folder run Python."""

import os
import time
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import forkserver

from . import forks


def test_every_fork_ends_with_its_own_exit_code_however_many_end_at_once(tmp_path, monkeypatch):
    """An exit code can be read once, and a process that starts asks after all others."""
    read = forkserver.read_signed

    def slowly(descriptor):
        time.sleep(0.1)
        return read(descriptor)

    monkeypatch.setattr(forkserver, "read_signed", slowly)
    script = tmp_path / "end.py"
    script.write_text("import sys\nsys.exit(int(sys.argv[1]))\n")
    codes = [1 + number % 5 for number in range(24)]

    def ended(code):
        return forks.run([str(script), str(code)], tmp_path, os.environ).returncode

    with ThreadPoolExecutor(16) as pool:
        assert list(pool.map(ended, codes)) == codes
