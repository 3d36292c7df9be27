"""The folders are those of docs/architecture.md, in an order in which arrows point one way, and their files small."""

import ast
import re
from graphlib import TopologicalSorter

import pytest

from gpca.declarations.registry import steps as declared_steps

from .documents import ROOT

PAGE = "\n".join((ROOT / f"docs/{page}.md").read_text() for page in ("architecture", "appendix"))
LONGEST = 400  # lines
MOST_AT_THE_TOP = 24  # modules
MODULES = sorted([*(ROOT / "gpca").rglob("*.py"), *(ROOT / "baselines").rglob("*.py")])


def as_list(files):
    return [files] if isinstance(files, str) else files


def rows(heading):
    """The cells of the first table below a heading, without its head."""
    table = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    return [line.strip("|").split("|") for line in table.splitlines() if line.startswith("|")][2:]


def code(cell):
    return re.findall(r"`([^`]+)`", cell)


ROOMS = [code(folder)[0] for folder, _ in rows("Layers")]


def room_of(module):
    """The folder that a module, given as words, belongs to."""
    folder = "/".join(module[:2]) + "/"
    return folder if folder in ROOMS else f"{module[0]}/"


def imported(path):
    """The modules of the project that a file imports anywhere, as words."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from ((*node.module.split("."), alias.name) for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (tuple(alias.name.split(".")) for alias in node.names)


def test_every_folder_has_its_row_and_none_is_gone():
    folders = {f"gpca/{path.name}/" for path in (ROOT / "gpca").iterdir() if (path / "__init__.py").is_file()}
    assert set(ROOMS) == folders | {"gpca/", "baselines/"}
    assert len(ROOMS) == len(set(ROOMS))


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_module_imports_only_from_folders_above_its_own(path):
    own = ROOMS.index(room_of(path.relative_to(ROOT).with_suffix("").parts))
    if path.stem == "__main__":  # the command line stands above all
        own = len(ROOMS)
    # The package offers its public names from wherever they are.
    others = [module for module in imported(path) if module[0] in ("gpca", "baselines")]
    assert [".".join(module) for module in others if ROOMS.index(room_of(module)) > own] == []


def test_modules_do_not_import_in_a_circle():
    """Not even where one is imported for its types alone, or inside a function."""
    names = {path.relative_to(ROOT).with_suffix("").parts: path for path in MODULES}
    graph = {
        name: {module if module in names else module[:-1] for module in imported(path)} - {name}
        for name, path in names.items()
    }
    assert set(TopologicalSorter(graph).static_order()) >= set(names)  # a circle raises a CycleError that lists it


def test_few_modules_are_at_the_top_and_no_file_of_tests_is_too_long():
    assert len([path for path in (ROOT / "gpca").glob("*.py") if not path.stem.startswith("__")]) <= MOST_AT_THE_TOP
    lines = {path.relative_to(ROOT): len(path.read_text().splitlines()) for path in (ROOT / "tests").rglob("*.py")}
    assert [str(path) for path, count in lines.items() if count > LONGEST] == []


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_module_is_too_long_to_be_read_at_once(path):
    assert len(path.read_text().splitlines()) <= LONGEST


def test_every_step_and_rule_file_has_its_stage():
    stages = rows("Stages")
    files = {name for *_, names in stages for name in code(names)} - {"sources/*.smk", "Snakefile"}
    rules = ROOT / "workflow/rules"
    written = {str(path.relative_to(rules)) for path in rules.rglob("*.smk")}
    steps = {step for name in written for step in re.findall(r'step="gpca\.([\w.:]+)"', (rules / name).read_text())}
    steps |= {step.run.removeprefix("gpca.") for step in declared_steps()}
    assert steps == {name for _, _, modules, _ in stages for name in code(modules)}
    assert files == written - {"common.smk", "functions.smk"}


def test_every_folder_of_the_results_that_rules_write_has_its_stage():
    rules = "".join(path.read_text() for path in (ROOT / "workflow/rules").rglob("*.smk"))
    written = set(re.findall(r"<results>/([a-z_]+)/", rules)) | {"tables", "figures"}
    patterns = [pattern for step in declared_steps() for files in step.outputs.values() for pattern in as_list(files)]
    written |= {pattern.split("/")[0] for pattern in patterns if "/" in pattern}
    assert {f"{folder}/" for folder in written} == {
        name for files, *_ in rows("Stages") for name in code(files) if name.endswith("/") and "{" not in name
    }


def test_no_name_of_the_rules_is_bound_in_two_ways():
    # All rule files share one namespace: a later import or assignment silently replaces what rules before it read.
    bound: dict[str, set[str]] = {}
    for path in sorted((ROOT / "workflow/rules").glob("*.smk")):
        text = path.read_text()
        for module, names in re.findall(r"^from ([\w.]+) import (\([^)]*\)|[^\n]+)", text, re.MULTILINE):
            for name in re.findall(r"(\w+)(?=\s*(?:,|$|\n))", re.sub(r"\w+ as ", "", names.strip("()"))):
                bound.setdefault(name, set()).add(module)
        for function, *assigned in re.findall(r"^(?:def (\w+)|(\w+)(?:, (\w+))? = )", text, re.MULTILINE):
            for name in filter(None, (function, *assigned)):
                bound.setdefault(name, set()).add(path.name)
    assert {name: places for name, places in bound.items() if len(places) > 1} == {}
