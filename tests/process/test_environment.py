import os
import subprocess
import sys
from pathlib import Path

import pytest

from gpca.process.environment import require_open3d, system_library_hint

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("library", "debian"), [("libGL.so.1", "libgl1"), ("libX11.so.6", "libx11-6"), ("libgomp.so.1", "libgomp1")]
)
def test_names_the_package_of_a_known_library(library, debian):
    hint = system_library_hint(f"{library}: cannot open shared object file: No such file or directory")
    assert library in hint
    assert f"apt-get install {debian}'" in hint
    assert "dnf install" in hint


def test_names_an_unknown_library_by_itself():
    hint = system_library_hint("/opt/x/libtbb.so.12: cannot open shared object file: No such file or directory")
    assert "libtbb.so.12" in hint
    assert "apt-get" not in hint


def test_no_hint_where_no_library_is_missing():
    assert system_library_hint("No module named 'open3d'") is None


def test_open3d_imports_here():
    assert require_open3d().__version__.startswith("0.19")


@pytest.mark.parametrize(
    ("package", "expected"),
    [
        ("import ctypes\nctypes.CDLL('libgpca-absent.so.3')\n", "provides libgpca-absent.so.3"),
        ("raise ImportError('libGL.so.1: cannot open shared object file: No such file')\n", "apt-get install libgl1"),
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
