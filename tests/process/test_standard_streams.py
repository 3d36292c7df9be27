"""What is printed arrives in any encoding, or the command says that it did not."""

import os
import subprocess
import sys

import pytest

from gpca.__main__ import COMMANDS
from tests.documents import ROOT

ASCII = {"PYTHONIOENCODING": "ascii"}
C_LOCALE = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
HELP = [sys.executable, "-m", "gpca", "--help"]
LINE = "gpca None: stdout: "


def gpca(arguments, redirection="", **variables):
    """Run a command with its streams as a shell would have them."""
    command = ["bash", "-c", f'"$@" {redirection}', "bash", *map(str, arguments)]
    return subprocess.run(
        command,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": ""} | variables,
        capture_output=True,
    )


def test_every_help_can_be_printed_in_ascii():
    code = (
        "import sys; from gpca.__main__ import main, COMMANDS\n"
        "for command in COMMANDS:\n"
        "    try: main([command, '--help'])\n"
        "    except SystemExit as end: assert end.code == 0\n"
    )
    done = gpca([sys.executable, "-c", code], **ASCII, **C_LOCALE)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.isascii()
    assert done.stdout.count(b"usage:") == len(COMMANDS)
    assert rb"\xd7" in done.stdout  # 4×4


@pytest.mark.parametrize("environment", [ASCII, C_LOCALE])
def test_an_explanation_can_be_printed_in_ascii(tmp_path, model, environment):
    import trimesh

    model.save(tmp_path / "model.pt")
    mesh = tmp_path / "tasse_ä.ply"
    trimesh.creation.box((0.04, 0.07, 0.10)).export(mesh)
    command = [sys.executable, "-m", "gpca", "explain", mesh, mesh, "--uncertainty", "--model", tmp_path / "model.pt"]
    done = gpca(command, **environment)
    assert done.returncode == 0, done.stderr
    assert done.stdout.isascii()
    assert rb"\xb0, " in done.stdout  # the spread in °
    assert b"Traceback" not in done.stderr


@pytest.mark.parametrize("environment", [ASCII, C_LOCALE])
def test_a_fault_can_be_printed_in_ascii(environment):
    done = gpca([sys.executable, "-m", "gpca", "check-config", "tasse_ä.yaml"], **environment)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert b"no such file" in done.stderr


@pytest.mark.parametrize(
    ("command", "redirection", "said"),
    [
        (HELP, "> /dev/full", "cannot be written (No space left on device)"),
        (HELP, "| (exec <&-; sleep 0); exit ${PIPESTATUS[0]}", "cannot be written (Broken pipe)"),
        (HELP, ">&-", "is closed; redirect it"),
        ([*HELP[:-1], "check-config"], "> /dev/full", "cannot be written (No space left on device)"),
        ([*HELP[:-1], "check-config"], ">&-", "is closed; redirect it"),
    ],
)
def test_what_cannot_be_printed_is_one_line_and_status_2(command, redirection, said):
    done = gpca(command, redirection)
    assert done.returncode == 2
    lines = done.stderr.decode().splitlines()
    assert len(lines) == 1, lines
    assert f"stdout: {said}" in lines[0]


@pytest.mark.parametrize("redirection", ["2>&-", "2>/dev/full"])
def test_where_stderr_is_gone_the_status_remains_and_stdout_stays_clean(redirection):
    done = gpca([sys.executable, "-m", "gpca", "check-config", "missing.yaml"], redirection)
    assert (done.returncode, done.stdout) == (2, b"")
