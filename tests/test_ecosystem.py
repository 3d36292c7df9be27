"""What other tools read of the project: hooks, the check on a server, the catalogue of workflows."""

import re
import tomllib

import yaml

from .documents import ROOT


def read(name):
    return yaml.safe_load((ROOT / name).read_text())


def test_the_server_runs_the_check_of_every_commit_and_every_hook_is_local():
    workflow = read(".github/workflows/ci.yml")
    assert ".ci/run" in [step.get("run") for step in workflow["jobs"]["check"]["steps"]]
    assert (ROOT / ".ci/run").stat().st_mode & 0o111
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    tools = project["project"]["optional-dependencies"]["dev"]
    repos = read(".pre-commit-config.yaml")["repos"]
    assert {repo["repo"] for repo in repos} == {"local"}
    for hook in (hook for repo in repos for hook in repo["hooks"]):
        assert hook["language"] == "system"
        assert hook["entry"].split()[0].removeprefix(".venv/bin/") in tools


def test_the_catalogue_finds_a_page_that_names_every_config():
    assert read(".snakemake-workflow-catalog.yml")["usage"]
    page = (ROOT / "config/README.md").read_text()
    assert set(re.findall(r"\]\((\w+\.yaml)\)", page)) == {path.name for path in (ROOT / "config").glob("*.yaml")}
