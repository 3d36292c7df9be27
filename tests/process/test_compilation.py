"""Compiled loops: where they are kept, and when they are compiled anew."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from gpca.process.compilation import NOTICE, REMEDY
from tests.documents import ROOT

CODE = "import numba, gpca.process.numba_cache; print(numba.config.CACHE_DIR)"


def imported(folder, code=CODE, **variables):
    kept = {name: value for name, value in os.environ.items() if name not in ("NUMBA_CACHE_DIR", "PYTHONPATH")}
    environment = kept | {"PYTHONDONTWRITEBYTECODE": "1"} | variables
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return done


@pytest.fixture
def package(tmp_path):
    """A package with a loop that calls one of another module."""
    for name in (
        "__init__.py",
        "process/code_files.py",
        "errors.py",
        "process/plugins.py",
        "process/__init__.py",
        "process/compilation.py",
        "process/numba_cache.py",
        "process/processor.py",
    ):
        (tmp_path / "gpca" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / "gpca" / name, tmp_path / "gpca" / name)
    upper = "from gpca.lower import lower\n@njit(cache=True)\ndef upper(x):\n    return 10 * lower(x)\n"
    (tmp_path / "gpca/upper.py").write_text("from gpca.process.compilation import njit\n" + upper)
    write_lower(tmp_path, 1)
    return tmp_path


def write_lower(folder, added):
    lower = f"@njit(cache=True)\ndef lower(x):\n    return x + {added}\n"
    (folder / "gpca/lower.py").write_text("from gpca.process.compilation import njit\n" + lower)


def folder_of(package, **variables):
    return Path(imported(package, **variables).stdout.strip()).parent


def test_loops_are_kept_beside_the_module_or_where_the_variable_says(package, tmp_path):
    assert folder_of(package) == package / "gpca/process/__pycache__"
    assert folder_of(package, NUMBA_CACHE_DIR=str(tmp_path / "mine")) == tmp_path / "mine"


def test_a_process_keeps_to_the_folder_of_its_parent(package, tmp_path):
    folder = imported(package, NUMBA_CACHE_DIR=str(tmp_path / "mine")).stdout
    assert imported(package, NUMBA_CACHE_DIR=folder.strip()).stdout == folder


@pytest.mark.parametrize("theirs", [False, True])
def test_without_a_place_of_its_own_the_folder_is_a_temporary_one_of_this_user(package, tmp_path, theirs):
    shutil.rmtree(package / "gpca/process/__pycache__", ignore_errors=True)
    (package / "gpca/process/__pycache__").write_text("")  # stops root, too
    ours = tmp_path / f"gpca-numba-{os.getuid()}"
    if theirs:
        (tmp_path / "theirs").mkdir()
        ours.symlink_to(tmp_path / "theirs")
    folder = folder_of(package, HOME="/dev/null", XDG_CACHE_HOME="", TMPDIR=str(tmp_path))
    assert (folder != ours) if theirs else (folder == ours)
    assert folder.stat().st_mode & 0o777 == 0o700


def test_a_first_call_says_that_it_compiles_and_later_ones_do_not(package):
    code = "from gpca.process.compilation import say_when_compiling as say; say(); say(); "
    code += "from gpca.upper import upper; upper(1); upper(1.0)"
    assert [imported(package, code).stderr for _ in range(2)] == [f"{NOTICE}{REMEDY}\n", ""]


def test_a_copy_elsewhere_takes_along_what_was_compiled(package, tmp_path_factory):
    code = "from gpca.upper import upper; print(upper(1), *upper.dispatcher.stats.cache_hits.values())"
    assert imported(package, code).stdout.strip() == "20"
    copy = shutil.copytree(package, tmp_path_factory.mktemp("elsewhere") / "copy")
    assert imported(copy, code).stdout.strip() == "20 1"


def test_loops_of_others_are_kept_too(package, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "theirs.py").write_text("from numba import njit\n@njit(cache=True)\ndef f(x):\n    return x\n")
    code = f"import sys; import gpca.process.numba_cache; sys.path.insert(0, {str(elsewhere)!r})\n"
    code += "from theirs import f; print(f(1), *f.stats.cache_hits.values())"
    assert [imported(package, code).stdout.strip() for _ in range(2)] == ["1", "1 1"]


def test_a_loop_is_compiled_anew_when_a_module_beneath_its_own_has_changed(package):
    code = "from gpca.upper import upper; print(upper(1), *upper.dispatcher.stats.cache_hits.values())"
    printed = []
    for added in (1, 1, 2):
        write_lower(package, added)
        printed.append(imported(package, code).stdout.strip())
    assert printed == ["20", "20 1", "30"]
