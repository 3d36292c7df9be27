"""``python -m gpca`` itself: its help, its version, wrong usage. Its commands are in tests/steps/ and tests/config/."""

import re
import subprocess
import sys

import pytest

import gpca
from gpca.__main__ import COMMANDS, main
from gpca.process.code_files import ROOT


def test_help_and_wrong_usage_need_no_heavy_library():
    code = (
        "import sys; from gpca.__main__ import main\n"
        "try: main(['--help'])\n"
        "finally: print({'torch', 'open3d', 'numpy'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0
    assert done.stdout.endswith("set()\n")
    for command in COMMANDS:
        assert command in done.stdout


@pytest.mark.parametrize("command", [None, *COMMANDS])
def test_help_is_plain_text(capsys, command):
    with pytest.raises(SystemExit) as caught:
        main([command, "--help"] if command else ["--help"])
    assert caught.value.code == 0
    out = capsys.readouterr().out
    assert out.startswith(f"usage: python -m gpca {command or ''}")
    assert not re.search(r"`|:\w+:|None", out), out


def test_the_version(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0
    assert capsys.readouterr().out == f"gpca {gpca.__version__}\n"


@pytest.mark.parametrize("words", [[], ["train"], ["explain", "--threads", "one"], ["explain"]])
def test_wrong_usage_is_argparses_status_2(words, capsys):
    with pytest.raises(SystemExit) as caught:
        main(words)
    assert caught.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith(" --help'") and "; see '" in line
