"""The same bits on a processor of another vendor, which QEMU emulates with estimates of 1 / x and 1 / √x of its own."""

import json
import os
import shutil
import subprocess
import sys

import pytest

from gpca.process.code_files import ROOT

from .process.test_processor import needs_the_level

QEMU = shutil.which("qemu-x86_64")
PROGRAM = (
    "from gpca.process.processor import prepare; prepare(); "
    "import json; from tests.emulated import fits; print(json.dumps(fits()))"
)


def hashes(*emulator: str) -> dict[str, str]:
    command = [*emulator, sys.executable, "-c", PROGRAM]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@needs_the_level
@pytest.mark.skipif(QEMU is None, reason="needs qemu-x86_64 (Debian's package qemu-user)")
def test_an_emulated_processor_gives_the_same_bits_where_torchs_root_does_not():
    here, there = hashes(), hashes(QEMU, "-cpu", "Haswell")
    different = {name for name in here if here[name] != there[name]}
    assert different == {"torch.sqrt"}  # without this one the emulation would not show what it is for
