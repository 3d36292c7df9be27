"""The template of a plugin, examples/plugin: installed, found in every registry, and planned with its rows."""

import runpy
import tomllib

import pytest
import yaml
from snakemake.utils import update_config

from gpca.active_learning.acquisition import strategy_module
from gpca.alignment.methods.registry import method_module
from gpca.config.check import check
from gpca.config.layers import without_false
from gpca.experiments.run import names_of
from gpca.explainers.registry import CAUSES, explainer_module
from gpca.objects.source import source_modules
from gpca.process.code_files import code_files
from gpca.process.plugins import GROUPS
from gpca.recovery.policies import policy_module

from .config.configs import load
from .documents import ROOT

TEMPLATE = ROOT / "examples/plugin"


@pytest.fixture
def installed(tmp_path, monkeypatch, apart):
    """The template, as pip would install it: its folder on the path, and its entry points in its metadata."""
    project = tomllib.loads((TEMPLATE / "pyproject.toml").read_text())["project"]
    info = tmp_path / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    groups = project["entry-points"]
    assert set(groups) == set(GROUPS)
    lines = [f"[{group}]\n" + "\n".join(f"{n} = {value}" for n, value in of.items()) for group, of in groups.items()]
    (info / "entry_points.txt").write_text("\n".join(lines))
    for folder in (TEMPLATE, tmp_path):
        monkeypatch.syspath_prepend(folder)


def test_its_own_tests_pass(installed, tmp_path):
    tests = runpy.run_path(str(TEMPLATE / "tests/test_plugin.py"))
    names = [name for name in tests if name.startswith("test_")]
    for name in names:
        tests[name](*([tmp_path] if "tmp_path" in tests[name].__code__.co_varnames else []))
    assert len(names) == len(GROUPS)


def test_its_config_gives_a_row_of_each_kind_and_its_files_are_code_of_these(installed):
    config = load()
    update_config(config, yaml.safe_load((TEMPLATE / "config/config.yaml").read_text()))
    config["data_dir"] = str(TEMPLATE / "data")
    sources = check(config)
    names = names_of(without_false(config), sources)
    rows = {"source": "boxes", "explainer": "my_nearest_quality", "cause_explainer": "my_nearest_quality"}
    rows |= {"method": "my_centers", "estimator": "my_residuals", "strategy": "my_least_confident"}
    assert {key: name for key, name in rows.items() if name in names[key]} == rows
    modules = [explainer_module("my_nearest_quality"), explainer_module("my_nearest_quality", CAUSES)]
    modules += [method_module("my_centers"), strategy_module("my_least_confident"), policy_module("my_last_first")]
    modules += source_modules(sources["boxes"])
    assert {module.split(".")[0] for module in modules} == {"my_gpca_plugin"}
    for module in modules:
        name = module.replace(".", "/")
        assert any(file.endswith(f"examples/plugin/{name}.py") for file in code_files(module))
