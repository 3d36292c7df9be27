"""Numbers on the command line: each option of each command has its bounds, and what is out of them is one line."""

import os
import subprocess
import sys
from argparse import Action, ArgumentParser
from pathlib import Path

import pytest

from gpca.__main__ import COMMANDS, load_command
from gpca.jobs.arguments import whole_number
from gpca.process.environment import require_open3d, system_library_hint
from tests.hostile import refusal


def options(command) -> list[Action]:
    parser = ArgumentParser()
    load_command(command)[0](parser)
    return parser._actions


NUMBERS = [
    (command, action.option_strings[0])
    for command in COMMANDS
    for action in options(command)
    if action.type not in (None, str) and "whole_number" in action.type.__qualname__
]


def test_no_command_takes_a_number_without_bounds():
    kinds = {(command, action.dest): action.type for command in COMMANDS for action in options(command)}
    assert [name for name, kind in kinds.items() if kind in (int, float)] == []
    assert NUMBERS
    assert [whole_number(-2, 2)(text) for text in ("-2", "2")] == [-2, 2]


@pytest.mark.parametrize(("command", "option"), NUMBERS)
def test_every_number_of_every_command_is_refused_where_it_cannot_be(tmp_path, command, option):
    refusal([command, option, "-5"], tmp_path, f"argument {option}", "whole number", "--help")


@pytest.mark.parametrize("text", ["1.5", "٣", "0", "257"])
def test_threads_that_cannot_be(tmp_path, text):
    refusal(["explain", "--threads", text], tmp_path, "argument --threads", "--help")


@pytest.mark.parametrize("text", ["-3", "nan", "", "1_000", "0"])
def test_lengths_that_cannot_be(tmp_path, text):
    refusal(["explain", "a.npy", "b.npy", "--scans", f"--voxel={text}"], tmp_path, "argument --voxel", "--help")


SETTINGS = {
    "no JSON": ("{", "invalid JSON"),
    "list": ("[]", "not a JSON object"),
    "number": ("3", "not a JSON object"),
    "empty": ("", "invalid JSON"),
    "key twice": ('{"kernel": "rbf", "kernel": "matern32"}', "key 'kernel' appears twice"),
    "nested": ('{"a": ' + "[" * 100_000 + "]" * 100_000 + "}", "nested too deeply"),
    "endless digits": ('{"a": ' + "9" * 5000 + "}", "invalid JSON"),
    "control character": ('{"title": "a\\nb"}', "control character"),
    "half a letter": ('{"title": "\\ud800"}', "control character"),
}


@pytest.mark.parametrize("name", SETTINGS)
def test_settings_that_cannot_be(tmp_path, name):
    text, word = SETTINGS[name]
    refusal(["explain", "source.ply", "target.ply", "--settings", text], tmp_path, word)


@pytest.mark.parametrize("name", ["", " ", "tiny\nother", "tiny\u2028", "\x1b[2J"])
def test_names_that_are_empty_or_take_more_than_a_line_are_refused(tmp_path, name):
    fault = "is empty or does not fit on one line; give a name"
    refusal(["explain", "source.ply", "target.ply", "--method", name], tmp_path, "--method", fault)


ROOT = Path(__file__).resolve().parents[2]


def test_a_missing_library_is_named():
    assert system_library_hint("No module named 'open3d'") is None
    hint = system_library_hint("/opt/x/libtbb.so.12: cannot open shared object file: No such file or directory")
    assert "libtbb.so.12" in hint


def test_open3d_imports_here():
    assert require_open3d().__version__.startswith("0.19")


def test_open3d_comes_without_its_windows_which_others_may_import_later():
    code = (
        "import sys; from gpca.process.environment import require_open3d as o3d\n"
        "assert o3d().geometry.PointCloud().is_empty()\n"
        "print({'dash', 'IPython', 'matplotlib', 'pandas', 'scipy', 'sklearn'} & set(sys.modules))\n"
        "import open3d.visualization; assert o3d().visualization.Visualizer\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert (done.stdout, done.returncode) == ("set()\n", 0), done.stderr


@pytest.mark.parametrize(
    ("package", "expected"),
    [
        ("import ctypes\nctypes.CDLL('libgpca-absent.so.3')\n", "provides libgpca-absent.so.3"),
        ("raise ImportError('libGL.so.1: cannot open shared object file: No such file')\n", "provides libGL.so.1"),
        ("raise ImportError('undefined symbol')\n", "make environment"),
    ],
)
def test_a_failing_import_is_one_line_and_status_2(tmp_path, package, expected):
    (tmp_path / "open3d.py").write_text(package)
    run = subprocess.run(
        [sys.executable, "-m", "gpca.process.environment"],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 2
    assert run.stdout == ""
    assert run.stderr.count("\n") == 1
    assert run.stderr.startswith("Open3D: cannot be imported")
    assert expected in run.stderr
