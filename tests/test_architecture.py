"""docs/architecture.md names the project as it is."""

import re

import pytest

from gpca.__main__ import STEPS

from .documents import ROOT

PAGE = (ROOT / "docs/architecture.md").read_text()


def rows(heading):
    """The cells of the first table below a heading, without its head."""
    table = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    return [line.strip("|").split("|") for line in table.splitlines() if line.startswith("|")][2:]


def code(cell):
    return re.findall(r"`([^`]+)`", cell)


@pytest.mark.parametrize("package", ["gpca", "baselines"])
def test_every_module_is_in_the_map_once_and_none_that_is_gone(package):
    listed = [code(folder)[0] + name for folder, modules, _ in rows("Module map") for name in code(modules)]
    listed = [path for path in listed if path.startswith(f"{package}/")]
    files = [path.relative_to(ROOT).with_suffix("") for path in (ROOT / package).rglob("*.py")]
    assert sorted(listed) == sorted(str(path) for path in files if path.name != "__init__")


def test_every_step_and_rule_file_has_its_stage():
    stages = rows("Stages")
    steps = {name for _, steps, _ in stages for name in code(steps) if name in STEPS}
    assert steps == set(STEPS) - {"label", "explain", "check-reference"}
    files = {name for *_, names in stages for name in code(names)} - {"sources/*.smk"}
    assert files == {path.name for path in (ROOT / "workflow/rules").glob("*.smk")} - {"common.smk"}


def test_every_folder_of_the_results_that_rules_write_has_its_stage():
    rules = "".join(path.read_text() for path in (ROOT / "workflow/rules").glob("*.smk"))
    written = set(re.findall(r"results/\{+run\}+/([a-z_]+)/", rules)) - {"logs", "benchmarks"}
    assert {f"{folder}/" for folder in written} == {
        name for files, *_ in rows("Stages") for name in code(files) if name.endswith("/")
    }
