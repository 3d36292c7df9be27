import importlib.util

import pytest

from gpca.process import code_files as module_under_test
from gpca.process.code_files import ROOT, code_files

FILES = {
    "gpca/__init__.py": "",
    "gpca/base.py": "import json\n",
    "gpca/middle.py": "from gpca import base\n",
    "gpca/late.py": "def f():\n    if True:\n        from gpca.middle import something\n",
    "gpca/cyclic.py": "import gpca.late\nimport gpca.cyclic\n",
    "gpca/unrelated.py": "import gpca.base\n",
    "gpca/group/__init__.py": "from gpca.group.one import One\n",
    "gpca/group/one.py": "from baselines.rival import thing\n",
    "gpca/says_so.py": "text = 'from gpca.unrelated import x'  # import gpca.unrelated\n",
    "gpca/typed.py": (
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from gpca.unrelated import x\n"
        "else:\n    import gpca.base\n"
    ),
    "gpca/steps.py": (
        "import gpca.unrelated\nfrom gpca.base import load as read\nLIMIT = read()\n"
        "def first(job):\n    from gpca.late import f\n    unrelated = gpca = None\n    return helper(f)\n"
        "def second(job):\n    return gpca.unrelated\n"
        "def helper(f):\n    return LIMIT\n"
    ),
    "baselines/__init__.py": "",
    "baselines/rival.py": "import numpy\n",
}


def forget():
    module_under_test._imports.cache_clear()
    module_under_test._file.cache_clear()


@pytest.fixture
def project(tmp_path, monkeypatch):
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(module_under_test, "ROOT", tmp_path)
    monkeypatch.chdir(tmp_path)
    forget()
    yield tmp_path
    forget()


@pytest.mark.parametrize(
    ("modules", "expected"),
    [
        (["gpca.base"], ["gpca/base.py"]),
        (["gpca.middle"], ["gpca/__init__.py", "gpca/base.py", "gpca/middle.py"]),
        (["gpca.late"], ["gpca/__init__.py", "gpca/base.py", "gpca/late.py", "gpca/middle.py"]),
        (["gpca.cyclic"], ["gpca/__init__.py", "gpca/base.py", "gpca/cyclic.py", "gpca/late.py", "gpca/middle.py"]),
        (["gpca.group"], ["baselines/rival.py", "gpca/group/__init__.py", "gpca/group/one.py"]),
        (["gpca.says_so"], ["gpca/says_so.py"]),
        (["gpca.typed"], ["gpca/base.py", "gpca/typed.py"]),
        (["gpca.unrelated", "gpca.base"], ["gpca/base.py", "gpca/unrelated.py"]),
        (["gpca.steps:first"], ["gpca/__init__.py", "gpca/base.py", "gpca/late.py", "gpca/middle.py", "gpca/steps.py"]),
        (["gpca.steps:second"], ["gpca/base.py", "gpca/steps.py", "gpca/unrelated.py"]),
        (["gpca.steps:helper", "gpca.steps:second"], ["gpca/base.py", "gpca/steps.py", "gpca/unrelated.py"]),
    ],
)
def test_imports_are_followed_wherever_they_stand(project, modules, expected):
    assert code_files(*modules) == expected


def test_paths_are_those_that_the_working_directory_sees(project, tmp_path_factory, monkeypatch):
    files = ["gpca/__init__.py", "gpca/base.py", "gpca/middle.py"]
    assert code_files("gpca.middle") == files
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    assert code_files("gpca.middle") == [f"{project}/{file}" for file in files]
    monkeypatch.chdir(project / "gpca")
    assert code_files("gpca.middle") == [f"{project}/{file}" for file in files]
    monkeypatch.chdir(project.parent)
    assert code_files("gpca.middle") == [f"{project.name}/{file}" for file in files]


STEPS = {  # module -> files that it depends on, and some that it does not
    "gpca.steps.pairs:objects": (
        {"gpca/seeds.py", "gpca/objects/source.py"},
        {"gpca/rigid.py", "gpca/classifier/gpc.py", "gpca/explainers/interface.py"},
    ),
    "gpca.steps.pairs:registrations": (
        {"gpca/rigid.py", "gpca/pairs/perturbation.py"},
        {"gpca/classifier/gpc.py", "gpca/explainers/interface.py"},
    ),
    "gpca.steps.pairs:train": (
        {"gpca/encoders/training.py", "gpca/pairs/dataset.py"},
        {"gpca/classifier/gpc.py", "gpca/explainers/interface.py"},
    ),
    "gpca.steps.pairs:embed": (
        {"gpca/encoders/training.py", "gpca/attribution/predictions.py"},
        {"gpca/classifier/gpc.py", "gpca/classifier/scores.py"},
    ),
    "gpca.steps.pairs:reduce": (
        {"gpca/encoders/reduction.py", "gpca/seeds.py"},
        {"gpca/encoders/training.py", "gpca/pairs/dataset.py", "gpca/classifier/gpc.py"},
    ),
    "gpca.steps.active_learning:embed_without": (
        {"gpca/encoders/training.py"},
        {"gpca/classifier/gpc.py", "gpca/active_learning/acquisition.py"},
    ),
    "gpca.steps.active_learning:learn_actively": (
        {"gpca/classifier/latents.py", "gpca/active_learning/stream.py", "gpca/active_learning/retraining.py"},
        {"gpca/explainers/interface.py", "gpca/encoders/training.py"},
    ),
    "gpca.steps.active_learning:learn_on_frames": (
        {"gpca/active_learning/retraining.py", "gpca/pairs/distances.py"},
        {"gpca/explainers/interface.py", "gpca/active_learning/stream.py", "gpca/frames/synthesis.py"},
    ),
    "gpca.steps.pairs:uncertainty": (
        {"gpca/alignment/icp_kernels.py", "gpca/uncertainty/designs.py"},
        {"gpca/classifier/gpc.py", "gpca/explainers/interface.py"},
    ),
    "gpca.steps.causes:model": (
        {"gpca/classifier/gpc.py", "gpca/encoders/training.py"},
        {"gpca/explainers/interface.py", "gpca/active_learning/acquisition.py"},
    ),
    "gpca.steps.runtime": (
        {"gpca/model/explainer.py", "gpca/active_learning/acquisition.py"},
        {"gpca/explainers/interface.py"},
    ),
    "gpca.steps.pairs:attribute": (
        {"gpca/explainers/interface.py", "gpca/classifier/scores.py"},
        {"gpca/classifier/gpc.py", "gpca/uncertainty/designs.py", "gpca/encoders/training.py"},
    ),
}


@pytest.mark.parametrize("step", STEPS)
def test_a_step_depends_on_what_it_uses_and_not_on_later_steps(step):
    used, later = STEPS[step]
    files = set(code_files(step))
    assert used <= files
    assert not later & files
    assert not [file for file in files if file.startswith("gpca/reporting/") or file == "gpca/attribution/metrics.py"]


MODULES = sorted({step.split(":")[0] for step in STEPS})


def test_every_module_that_a_step_loads_is_among_its_files():
    """Against Python itself: what is loaded when the step's module is imported, packages' own files apart.

    Each in a process of its own, forked from one that has loaded the libraries: they take most of the seconds.
    """
    import subprocess
    import sys

    code = f"""
import os, sys
from importlib import import_module
import gpytorch, numba, numpy, pandas, scipy.spatial, scipy.stats, sklearn.cluster, torch
for step in {MODULES}:
    if os.fork():
        assert os.wait()[1] == 0, step
    else:
        import_module(step)
        print(step, *(name for name in sys.modules if name.split(".")[0] == "gpca"), flush=True)
        os._exit(0)
"""
    loaded = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    lines = [line.split() for line in loaded.stdout.splitlines()]
    assert [step for step, *_ in lines] == MODULES
    for step, *modules in lines:
        files = set(code_files(step))
        for module in modules:
            if importlib.util.find_spec(module).submodule_search_locations is None:
                assert module.replace(".", "/") + ".py" in files, step
