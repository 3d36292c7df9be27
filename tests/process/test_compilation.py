"""Compiled loops: where they are kept, and when they are compiled anew."""

import copy
import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gpca.process.compilation import MODULES, NOTICE, OVER_CLOUDS, REMEDY, Loop, library
from gpca.process.processor import may_pin
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
    process = ("__init__", "build_loops", "code_files", "compilation", "numba_cache", "plugins", "processor")
    modules = ("__init__", "errors", "io/__init__", "io/files", *(f"process/{name}" for name in process))
    for name in (f"{module}.py" for module in modules):
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


@pytest.mark.parametrize("threads", [1, 2])
def test_a_loop_over_clouds_is_shared_out_where_there_are_threads_for_it(monkeypatch, threads):
    monkeypatch.setenv("NUMBA_NUM_THREADS", str(threads))
    loop = Loop(lambda x: x, "", OVER_CLOUDS | {"cache": False})
    assert loop.dispatcher.targetoptions["parallel"] == (threads == 2)


def test_without_a_place_of_its_own_the_folder_is_a_temporary_one_of_this_user(package, tmp_path):
    shutil.rmtree(package / "gpca/process/__pycache__", ignore_errors=True)
    (package / "gpca/process/__pycache__").write_text("")  # stops root, too
    folder = folder_of(package, HOME="/dev/null", XDG_CACHE_HOME="", TMPDIR=str(tmp_path))
    assert folder.parent == tmp_path
    assert folder.stat().st_mode & 0o777 == 0o700


def test_a_first_call_says_that_it_compiles_and_later_ones_do_not(package):
    code = "from gpca.process.compilation import say_when_compiling as say; say(); say(); "
    code += "from gpca.upper import upper; upper(1); upper(1.0)"
    assert [imported(package, code).stderr for _ in range(2)] == [f"{NOTICE}{REMEDY}\n", ""]


def test_a_loop_is_compiled_anew_when_a_module_beneath_its_own_has_changed(package):
    code = "from gpca.upper import upper; print(upper(1), *upper.dispatcher.stats.cache_hits.values())"
    printed = []
    for added in (1, 1, 2):
        write_lower(package, added)
        printed.append(imported(package, code).stdout.strip())
    assert printed == ["20", "20 1", "30"]


needs_compiler = pytest.mark.skipif(not shutil.which("cc") or not may_pin(), reason="no C compiler or no AVX2")
needs_library = pytest.mark.skipif(library() is None, reason="'python -m gpca.process.build_loops' makes the library")
BUILD = "import gpca.process.compilation as c, sys; c.MODULES = 'gpca.filling', 'gpca.lower'; "
BUILD += "from gpca.process.build_loops import main; sys.exit(main()) "
CALL = "import gpca.process.compilation as c, sys; c.MODULES = 'gpca.filling', 'gpca.lower'; import numpy as np; "
CALL += "from gpca.filling import fill; x = np.ones(3); fill(x, (x, 2)); print(*x, 'numba' in sys.modules)"
FILL = """
import numpy as np
from gpca.lower import lower
from gpca.process.compilation import njit
@njit(ahead="d1 ( d1 l )", cache=True)
def fill(out, pair):
    room = np.zeros(len(out))
    for i in range(len(out)):
        room[i] = lower(pair[0][i]) * pair[1]
    for i in range(len(out)):
        out[i] += room[i] / len(out)
"""


@needs_compiler
def test_a_library_of_loops_has_the_same_bytes_each_time_and_is_used_while_it_is_of_the_same_sources(package):
    (package / "gpca/filling.py").write_text(FILL)
    path = package / "gpca/process/loops.so"
    value = 1 + 4 / 3
    assert imported(package, CALL).stdout == f"{value} {value} {value} True\n"
    imported(package, BUILD)
    first = path.read_bytes()
    assert imported(package, BUILD).stdout == ""  # nothing to do
    path.unlink()
    imported(package, BUILD)
    assert path.read_bytes() == first
    assert imported(package, CALL).stdout == f"{value} {value} {value} False\n"
    assert imported(package, CALL, GPCA_INSTRUCTIONS="native").stdout == f"{value} {value} {value} True\n"
    write_lower(package, 0)
    value = 1 + 2 / 3
    assert imported(package, CALL).stdout == f"{value} {value} {value} True\n"
    imported(package, BUILD)
    assert imported(package, CALL).stdout == f"{value} {value} {value} False\n"


def test_without_a_compiler_one_line_says_so(package):
    code = BUILD.replace("sys.exit(main())", "print(main())")
    done = imported(package, code, PATH="")
    assert done.stdout == "1\n"
    assert done.stderr.startswith("no loops are compiled ahead of their first call: ")
    assert done.stderr.count("\n") == 1


@needs_library
def test_registrations_and_fits_need_no_numba():
    code = """
import sys, numpy as np
from gpca.alignment.batched_icp import BatchedICP, ICPSettings
from gpca.reenactment.mixture import Mixture
points = np.random.default_rng(0).uniform(-0.5, 0.5, size=(100, 3))
BatchedICP(points, ICPSettings()).register(points, np.eye(4)[None])
Mixture(points, 0.01).fit(points, np.eye(4)[None], 3)
print("numba" in sys.modules)
"""
    assert imported(ROOT, code).stdout == "False\n"


@needs_library
def test_the_library_has_the_bits_of_numba(monkeypatch):
    """Every loop is called by what it is for, twice: by the library, and by numba on copies."""
    from gpca.alignment.batched_icp import BatchedICP, BatchedPlaneICP, ICPSettings, make_target, pulls
    from gpca.encoders import edge_kernels
    from gpca.reenactment.mixture import Anchor, Mixture, densities_of
    from gpca.reenactment.surface import ModelSurface, share_within

    by_library, ran = Loop.__call__, set()

    def by_both(loop, *arguments):
        copies = copy.deepcopy(arguments)
        by_library(loop, *arguments)
        assert loop._machine_code
        loop.dispatcher(*copies)
        for ours, theirs in zip(arguments, copies, strict=True):
            parts = (whole if isinstance(whole, tuple) else [whole] for whole in (ours, theirs))
            for one, other in zip(*parts, strict=True):
                assert np.asarray(one).tobytes() == np.asarray(other).tobytes(), loop.symbol
        ran.add(loop.symbol)

    monkeypatch.setattr(Loop, "__call__", by_both)
    random = np.random.default_rng(0)
    model = random.normal(size=(300, 3)) * [0.2, 0.3, 0.1]
    observed = model[:200] + random.normal(size=(200, 3)) * 0.01
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, :3, 3] = random.normal(size=(3, 3)) * 0.05
    BatchedICP(model, ICPSettings()).register(observed, poses)
    normals = model / np.linalg.norm(model, axis=1, keepdims=True)
    BatchedPlaneICP(model, normals, ICPSettings()).register(observed, poses)
    pulls(make_target(model, 0.1), observed, poses)
    for moving, anchor in ((True, None), (True, Anchor(0.3, 0.1)), (False, None)):
        Mixture(model, 0.01).fit(observed, poses, 10, moving, anchor)
    Mixture(model, 0.01).fit(observed, poses, 10, densities=densities_of(observed, model))
    surface = ModelSurface(model)
    surface.residuals(observed)
    surface.distances(observed)
    share_within(model, observed, 0.01, random)
    ac, distances = (random.normal(size=(3, 50, columns)).astype(np.float32) for columns in (22, 50))
    gamma, beta = random.normal(size=(2, 11)).astype(np.float32)
    neighbors = edge_kernels.smallest_k(distances, 8)
    edge_kernels.gather_max_affine(ac, neighbors, gamma, beta, 0.2)
    *passed, mean, variance = edge_kernels.gather_extreme_and_sums(ac, neighbors, gamma)
    mean, deviation = mean.astype(np.float32), (variance**0.5).astype(np.float32)
    out = edge_kernels.normalize_activate(passed[0], mean, deviation, gamma, beta, 0.2)
    edge_kernels.edge_max_backward(out, ac, neighbors, *passed, mean, deviation, gamma, out, neighbors.size, 0.2)
    loops = [loop for module in MODULES for loop in vars(importlib.import_module(module)).values()]
    assert ran == {loop.symbol for loop in loops if isinstance(loop, Loop) and loop.ahead}
