"""What pyproject.toml names is what the code imports or runs, and environment.lock holds that and what it needs."""

import ast
import importlib.metadata
import re
import sys
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from gpca.alignment.methods.registry import methods
from gpca.process.code_files import code_files
from gpca.process.environment import MODULES

from .documents import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
RUNS, CHECKS = ("gpca", "baselines", "workflow"), ("benchmarks", "tests")
EXTRAS = ("workflow", "methods", "dev")
# Imported by their names, and only where they are installed; nothing else is missing without them.
OPTIONAL = {canonicalize_name(entry.package) for entry in methods().values() if entry.package}
# Modules that are not called as their packages are.
CALLED = {
    "PIL": "pillow",
    "open3d": "open3d-cpu",
    "skactiveml": "scikit-activeml",
    "sklearn": "scikit-learn",
    "umap": "umap-learn",
    "yaml": "pyyaml",
}
# What is run, by name or as a plugin, and imported by nobody.
RUN = {"mypy", "pytest-cov", "ruff", "setuptools", "snakefmt", "snakemake", "snakemake-executor-plugin-slurm"}


def requirements(*lists):
    """What pyproject.toml names for this system: for the library, and in extras and those that they hold."""
    named = [PROJECT["dependencies"], *(PROJECT["optional-dependencies"][name] for name in lists)]
    found = [Requirement(line) for lines in named for line in lines]
    held = {extra for requirement in found if requirement.name == PROJECT["name"] for extra in requirement.extras}
    if held - set(lists):
        return requirements(*lists, *sorted(held - set(lists)))
    found = [requirement for requirement in found if requirement.name != PROJECT["name"]]
    return [requirement for requirement in found if requirement.marker is None or requirement.marker.evaluate()]


def lock():
    """The lines of environment.lock that are packages."""
    return [line for line in (ROOT / "environment.lock").read_text().splitlines() if line and line[0] != "#"]


def pinned():
    """Package -> version, of environment.lock."""
    return {canonicalize_name(name): version for name, version in (line.split("==") for line in lock())}


def test_the_lock_pins_every_package_no_build_and_nothing_that_nothing_needs():
    assert all(line.count("==") == 1 and "+" not in line and "@" not in line for line in lock())
    assert not [line for line in lock() if line.lower().startswith(("nvidia", "cuda", "triton"))]
    for requirement in requirements(*EXTRAS):
        assert requirement.specifier.contains(pinned()[canonicalize_name(requirement.name)]), requirement
    assert set(pinned()) == needed_by(requirements(*EXTRAS))


def test_wheels_have_the_loops_of_the_locked_numba():
    build = map(Requirement, tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"])
    versions = {line.name: str(line.specifier) for line in build if line.name != "setuptools"}
    assert versions == {name: f"=={pinned()[name]}" for name in ("numba", "numpy")}


def test_every_file_of_the_lock_but_torch_is_checked_by_its_hash():
    text = (ROOT / "environment.hashes").read_text().replace(" \\\n", "")
    entries = [line.split() for line in text.splitlines() if line[0] != "#"]
    hashed = {canonicalize_name(name): version for name, version in (entry[0].split("==") for entry in entries)}
    assert hashed == {name: version for name, version in pinned().items() if name != "torch"}
    for _, *hashes in entries:
        assert hashes
        assert all(re.fullmatch(r"--hash=sha256:[0-9a-f]{64}", of) for of in hashes)


def required_by(package):
    """What a package names; an optional one that is not installed here, nothing."""
    try:
        return importlib.metadata.requires(package) or ()
    except importlib.metadata.PackageNotFoundError:
        assert package in OPTIONAL
        return ()


def needed_by(requirements):
    """The packages of the lock that these requirements name, and that those need."""
    needed, open_requirements = set(), list(requirements)
    while open_requirements:
        requirement = open_requirements.pop()
        key = canonicalize_name(requirement.name), *sorted(requirement.extras)
        if key[0] not in pinned() or key in needed:
            continue
        needed.add(key)
        for further in map(Requirement, required_by(key[0])):
            extras = requirement.extras or {""}
            if further.marker is None or any(further.marker.evaluate({"extra": extra}) for extra in extras):
                open_requirements.append(further)
    return {name for name, *_ in needed}


def files_of(*folders):
    return [path for folder in folders for path in (ROOT / folder).rglob("*.py")]


def library():
    """The files of the steps and of `gpca explain`."""
    steps = [*(ROOT / "gpca/steps").glob("[!_]*.py"), *(ROOT / "gpca/experiments").rglob("*step.py")]
    modules = (".".join(path.relative_to(ROOT).with_suffix("").parts) for path in steps)
    used = map(Path, code_files(*modules, "gpca.commands.explain"))
    return [*(path for path in used if path.suffix == ".py"), *files_of("baselines")]


def imported(files):
    """Packages of others that the files import, anywhere in their text."""
    modules = set()
    for file in files:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                modules |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                modules.add(node.module.split(".")[0])
    others = modules - sys.stdlib_module_names - {"gpca", "baselines", "benchmarks", "docs", "tests"}
    return {canonicalize_name(CALLED.get(module, module)) for module in others}


@pytest.mark.parametrize(
    ("files", "lists"),
    [(library(), ("suite",)), (files_of(*RUNS), ("workflow",)), (files_of(*RUNS, *CHECKS), ("workflow", "dev"))],
)
def test_what_is_imported_is_named_where_it_is_needed(files, lists):
    assert imported(files) <= {canonicalize_name(requirement.name) for requirement in requirements(*lists)}


def test_what_is_named_is_imported_or_run_and_what_is_optional_an_extra_of_its_own():
    named = {canonicalize_name(requirement.name) for requirement in requirements(*EXTRAS)}
    assert named == imported(files_of(*RUNS, *CHECKS)) | RUN | OPTIONAL
    own = requirements("methods")[len(requirements()) :]
    assert {canonicalize_name(requirement.name) for requirement in own} == OPTIONAL


def test_what_an_extra_installs_is_named_by_it_where_it_is_missing():
    assert set(MODULES) < set(PROJECT["optional-dependencies"])
    for extra, modules in MODULES.items():
        own = {canonicalize_name(Requirement(line).name) for line in PROJECT["optional-dependencies"][extra]}
        own -= {PROJECT["name"], "open3d", *map(canonicalize_name, RUN - {"snakemake"})}
        assert {canonicalize_name(CALLED.get(module, module)) for module in modules} == own


def test_the_conda_environment_of_the_rules_holds_the_lock():
    conda = yaml.safe_load((ROOT / "workflow" / "envs" / "gpca.yaml").read_text())
    assert conda["dependencies"][-1]["pip"] == lock()
