"""Compiled loops where nothing can be kept beside them, as in a read-only checkout of a user without a home."""

import os
import shutil
import subprocess
import sys

import pytest

from gpca.process.compilation import NOTICE, njit
from tests.documents import ROOT

CODE = "import numba, gpca.alignment.icp_kernels; print(numba.config.CACHE_DIR)"
PACKAGES = ("gpca", "gpca/alignment", "gpca/encoders")


def imported(folder, **variables):
    environment = {name: value for name, value in os.environ.items() if name not in ("NUMBA_CACHE_DIR", "PYTHONPATH")}
    return subprocess.run(
        [sys.executable, "-c", CODE], cwd=folder, env=environment | variables, capture_output=True, text=True
    )


@pytest.fixture
def read_only(tmp_path):
    """A copy of the package; a file stands where each cache would be, which stops root too."""
    copy = tmp_path / "checkout"
    shutil.copytree(ROOT / "gpca", copy / "gpca", ignore=shutil.ignore_patterns("__pycache__"))
    for package in PACKAGES:
        (copy / package / "__pycache__").write_text("")
    return copy


def test_without_a_place_of_its_own_the_cache_is_a_temporary_folder(read_only, tmp_path):
    done = imported(read_only, HOME="/dev/null", XDG_CACHE_HOME="", TMPDIR=str(tmp_path))
    assert done.returncode == 0, done.stderr[-2000:]
    folder = tmp_path / f"gpca-numba-{os.getuid()}"
    assert done.stdout.strip() == str(folder)
    assert folder.stat().st_mode & 0o777 == 0o700
    assert imported(read_only, HOME="/dev/null", XDG_CACHE_HOME="", TMPDIR=str(tmp_path)).stdout == done.stdout


def test_a_folder_that_somebody_else_has_made_is_not_taken(read_only, tmp_path):
    (tmp_path / "theirs").mkdir()
    (tmp_path / f"gpca-numba-{os.getuid()}").symlink_to(tmp_path / "theirs")
    done = imported(read_only, HOME="/dev/null", XDG_CACHE_HOME="", TMPDIR=str(tmp_path))
    assert done.returncode == 0, done.stderr[-2000:]
    assert "gpca-numba-" in done.stdout
    assert done.stdout.strip() != str(tmp_path / f"gpca-numba-{os.getuid()}")


def test_a_missing_folder_for_temporary_files_is_no_fault(read_only):
    done = imported(read_only, HOME="/dev/null", XDG_CACHE_HOME="", TMPDIR="/nowhere/at/all")
    assert done.returncode == 0, done.stderr[-2000:]


def test_elsewhere_numba_chooses_itself(tmp_path):
    assert imported(ROOT).stdout == "\n"
    assert imported(ROOT, NUMBA_CACHE_DIR=str(tmp_path)).stdout == f"{tmp_path}\n"


def test_a_first_call_says_that_it_compiles_and_later_ones_do_not(tmp_path):
    (tmp_path / "loops.py").write_text("from numba import njit\n@njit(cache=True)\ndef twice(x):\n    return 2 * x\n")
    code = (
        "from gpca.process.compilation import say_when_compiling as say; "
        "say(); say(); from loops import twice; twice(1); "
    )
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": f"{ROOT}:{tmp_path}"}
    said = []
    for _ in range(2):
        command = [sys.executable, "-c", code + "twice(1.0)"]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[-2000:]
        said.append(done.stderr)
    assert said == [f"{NOTICE}\n", ""]


def test_a_loop_is_compiled_anew_when_a_module_beneath_its_own_has_changed(tmp_path):
    package = tmp_path / "gpca"
    package.mkdir()
    for name in ("__init__.py", "code_files.py", "compilation.py"):
        shutil.copy(ROOT / "gpca" / name, package / name)
    njit = "from gpca.process.compilation import njit\n"
    upper = "from gpca.lower import lower\n@njit(cache=True)\ndef upper(x):\n    return 10 * lower(x)\n"
    (package / "upper.py").write_text(njit + upper)
    code = "from gpca.upper import upper; print(upper(1), *upper.stats.cache_hits.values())"
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
    said = []
    for added in (1, 1, 2):
        (package / "lower.py").write_text(f"{njit}@njit(cache=True)\ndef lower(x):\n    return x + {added}\n")
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr[-2000:]
        said.append(done.stdout.strip())
    assert said == ["20", "20 1", "30"]


def test_a_numba_that_keeps_its_stamp_elsewhere_fails_at_once(monkeypatch):
    monkeypatch.setattr("numba.core.caching.IndexDataCacheFile", lambda **_: type("Renamed", (), {})())
    with pytest.raises(AttributeError, match="_source_stamp"):
        njit(cache=True)(lambda x: x)
