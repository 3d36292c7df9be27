"""The documentation does what it says: links, commands, examples and numbers are checked against the project."""

import re
import shlex
import subprocess
import sys
from argparse import ArgumentParser
from dataclasses import fields
from functools import cache
from importlib.util import find_spec

import pytest
import yaml

from gpca.__main__ import COMMANDS, load_command
from gpca.declarations.registry import registered, steps
from gpca.objects.entry import SourceEntry
from gpca.steps.control_samples import CONTROLS

from .documents import PAGES, ROOT, anchor_of, commands, our_files, relative

# Hosts that our own files may name; those of datasets stand in the config alone.
LITERATURE = {"arxiv.org", "github.com", "pointclouds.org", "json-schema.org"}
VOCABULARIES = {"w3id.org", "spdx.org"}  # of the RO-Crate: names of terms and licenses, which nothing is fetched from
DATA = {"rgbd-dataset.cs.washington.edu", "huggingface.co", "3dmatch.cs.princeton.edu", "graphics.stanford.edu"}
MOST_PAGES, MOST_WORDS = 16, {"README": 900, "docs": 12_000}  # without those made by a command, and the appendix


# --- links, commands, numbers ---


def anchors(page):
    """The anchors of a page's headings, as they are made from their text."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    return set(map(anchor_of, re.findall(r"^#+ .+$", text, re.MULTILINE)))


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_every_relative_link_leads_to_a_file_and_a_heading_of_it(page):
    links = re.findall(r"\[[^\]]*\]\(([^)\s]+)\)", page.read_text())
    for link in (link for link in links if not link.startswith(("http://", "https://"))):
        path, _, anchor = link.partition("#")
        file = page.parent / path if path else page
        assert file.exists(), link
        assert not anchor or anchor in anchors(file), link


def test_every_page_that_code_and_configs_name_is_there():
    named = {}
    for path in our_files():
        if path.suffix in (".py", ".yaml", ".smk") and "tests" not in path.parts:
            named |= dict.fromkeys(re.findall(r"(?<!/)docs/\w+\.md", path.read_text()), path)
    assert [f"{relative(path)}: {page}" for page, path in named.items() if not (ROOT / page).is_file()] == []


@pytest.mark.parametrize("command", commands("make "))
def test_every_make_target_and_variable_exists(command):
    makefile = (ROOT / "Makefile").read_text()
    words = shlex.split(command)[1:]
    targets = [word for word in words if "=" not in word]
    assert set(targets) <= set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))
    variables = {word.split("=")[0] for word in words if "=" in word}
    assert variables <= set(re.findall(r"^([A-Z_]+) \?=", makefile, re.MULTILINE))
    assert words


@cache
def options_of(program):
    """The options that a command of `python -m gpca`, or a script, has."""
    if program in COMMANDS:
        parser = ArgumentParser()
        load_command(program)[0](parser)
        return {"--threads", "--settings", *parser._option_string_actions}
    shown = subprocess.run([sys.executable, program, "--help"], cwd=ROOT, capture_output=True, text=True, check=True)
    return set(re.findall(r"--[\w-]+", shown.stdout))


@pytest.mark.parametrize("command", [*commands("python "), *commands("gpca ")])
def test_every_python_command_names_something_that_is_there(command):
    words = shlex.split(command.replace("gpca", "python -m gpca", command.startswith("gpca ")))[1:]
    flags = {word.split("=")[0] for word in words if word.startswith("--")}
    if words[0] != "-m":
        assert (ROOT / words[0]).is_file()
        assert not flags or flags <= options_of(words[0])
    elif words[1] == "gpca":
        name = (*words[2:], "--help")[0]
        assert name in (*COMMANDS, "--help", "--version")
        assert name not in COMMANDS or flags <= options_of(name)
    else:
        assert find_spec(words[1]) is not None


def words(text):
    """Number of words of a page as it is read, without numbers, comments and blocks of code."""
    text = re.sub(r"<!--.*?-->|^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    return sum(bool(re.search(r"[^\W\d_]", word)) for word in text.split())


def test_the_documentation_is_short_and_the_readme_leads_to_every_page():
    readme = (ROOT / "README.md").read_text()
    pages = {path.stem: path.read_text() for path in (ROOT / "docs").glob("*.md")}
    assert set(pages) == set(re.findall(r"\]\(docs/(\w+)\.md\)", readme.split("## Documentation")[1]))
    assert words(readme) <= MOST_WORDS["README"]
    read = {name: words(text) for name, text in pages.items() if name not in ("cli", "appendix")}
    assert len(read) <= MOST_PAGES
    assert sum(read.values()) <= MOST_WORDS["docs"], read


def test_every_setting_on_a_page_has_the_value_of_the_config():
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    text = "\n".join(path.read_text() for path in sorted((ROOT / "docs").glob("*.md")))
    rows = re.findall(r"^\| `([a-z0-9_]+\.[a-z0-9_.]+)` \| `([^`]+)` \|", text, re.MULTILINE)
    named = re.findall(r"[(,] ?`(\w+\.[\w.]+)`: (\[[^\]]+\]|[\w.+-]+)", " ".join(text.split()))
    assert len(named) >= 12
    for key, documented in (*rows, *named):
        value = config
        for part in key.split("."):
            value = value[part]
        assert yaml.safe_load(documented) == value, key


def test_the_tolerances_of_the_page_are_those_of_the_config():
    tolerances = yaml.safe_load((ROOT / "config/config.yaml").read_text())["comparison"]["tolerances"]
    page = (ROOT / "docs/comparison.md").read_text()
    shown = re.findall(r"^\| [^|]+ \| ([\d.]+) \| ([\d.]+) \|$", page, re.MULTILINE)
    assert {tuple(map(float, row)) for row in shown} == {
        (tolerance["reproduced"], tolerance["close"]) for tolerance in tolerances.values()
    }


def names_of(page):
    """What the page describes in the default config; those of a family are described by its ending, `…_5`."""
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    families = re.compile("shap_removal(?=_)|sa_local_removal(?=_)|label_noise(?=_)")
    names = {
        "baselines": {*config["explainers"], *config["controls"]["explainers"], *CONTROLS} - {"gpca_paper"},
        "causes": config["diagnosis"]["explainers"],
        "registration": {*config["estimators"], *config["methods"]},
        "active_learning": config["learners"],
    }[page]
    return {name: families.sub("…", name) for name in names}


@pytest.mark.parametrize("page", ["baselines", "causes", "registration", "active_learning"])
def test_every_name_of_the_config_is_described(page):
    text = (ROOT / f"docs/{page}.md").read_text()
    for name, short in names_of(page).items():
        assert f"`{name}`" in text or f"`{short}`" in text, name


def test_every_key_of_a_source_is_described():
    keys = [field.name for field in fields(SourceEntry)]
    text = (ROOT / "config/sources.yaml").read_text()
    [described] = re.findall(r"^# Keys: (.+?\))\.$", text, re.MULTILINE | re.DOTALL)
    names = re.findall(r"(?:^|; |or )(\w+)", re.sub(r"\(.*?\)", "", described.replace("\n# ", " "), flags=re.DOTALL))
    assert sorted(names) == sorted(keys)


def test_the_resources_of_the_page_on_clusters_are_those_of_the_rules_and_the_profile():
    files = set((ROOT / "workflow/rules").rglob("*.smk")) - {ROOT / "workflow/rules/targets.smk"}
    rules = "".join(path.read_text() for path in files)
    profile = yaml.safe_load((ROOT / "profiles/default/config.yaml").read_text())
    page = (ROOT / "workflow/profiles/README.md").read_text()
    usual = {"threads": 1} | profile["default-resources"]
    patterns = {"threads": r"threads: (\d+)$", "mem_mb": r"mem_mb=(\d+)", "runtime": r"runtime=(\d+)"}
    for declared, pattern in patterns.items():
        declared_by_steps = {step.resources[declared] for step in steps() if declared in step.resources}
        values = sorted({usual[declared], *declared_by_steps, *map(int, re.findall(pattern, rules, re.MULTILINE))})
        [shown] = re.findall(rf"^\| `{declared}`.*\| (\d+(?: to \d+)?)\b[^|]*\|$", page, re.MULTILINE)
        assert shown == (f"{values[0]} to {values[-1]}" if len(values) > 1 else str(values[0]))


@pytest.mark.parametrize("page", ["README.md", "docs/reproducing.md"])
def test_every_listed_table_and_figure_is_made(page):
    listed = re.findall(r"`(tables|figures)/([a-z0-9_]+)[`.]", (ROOT / page).read_text())
    made = {(result.kind, result.name) for result in registered()}
    assert {kind for kind, _ in listed} == {"tables", "figures"}
    for kind, name in listed:
        name = re.sub(r"^objects_\w*", "objects_{source}", name)
        assert (kind, name) in made


# --- nothing of one machine ---


OF_A_MACHINE = r"(?<![\w.~>}])/(?:home|root|Users|work|mnt|scratch)/\w+"
OF_A_REGISTRY = r"\b(?:pypi|pythonhosted|anaconda|pytorch)\.(?:org|com)\b"


def test_no_file_names_a_machines_path_a_registry_or_an_unknown_host():
    found = []
    for path in our_files():
        name, text = relative(path), path.read_text(encoding="utf-8")
        for pattern in (OF_A_MACHINE, OF_A_REGISTRY):
            found += [(name, match) for match in re.findall(pattern, text)]
        of_data = name in ("config/bop.yaml", "config/config.yaml") or name.startswith("results/reference/")
        allowed = LITERATURE | VOCABULARIES | (DATA if of_data else set())
        hosts = set() if name.startswith("tests/") else set(re.findall(r"https?://([\w.-]+)", text))
        found += [(name, host) for host in sorted(hosts - allowed)]
    assert found == []
