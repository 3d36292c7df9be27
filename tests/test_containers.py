"""The recipes of the images; building them needs a network and is left to those who have one."""

import re

import yaml

from .documents import ROOT

DOCKER = (ROOT / "containers/Dockerfile").read_text()
APPTAINER = (ROOT / "containers/gpca.def").read_text()


def packages(recipe):
    """What the recipe installs of the system."""
    [words] = re.findall(r"--no-install-recommends \\\n([^&\n]+?)(?: \\)?\n", recipe)
    return set(words.split())


def test_both_install_what_the_check_needs_make_the_results_and_hold_what_git_keeps():
    check = (ROOT / ".ci/run").read_text()
    libraries = {"libgl1", "libx11-6", "libgomp1"}
    assert all(f"missing+=({library})" in check for library in libraries)
    workflow = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())["jobs"]["check"]
    [given] = re.findall(r"--no-install-recommends (.+)", workflow["steps"][0]["run"])
    assert packages(DOCKER) == packages(APPTAINER) == libraries | {"gcc", "libc6-dev", "python3-venv", *given.split()}
    for recipe in (DOCKER, APPTAINER):
        assert f"debian:{workflow['container'].removeprefix('debian:')}-slim" in recipe
    assert re.search(r"^RUN make environment\n\nCMD \[\"make\", \"results\"\]\n\Z", DOCKER, re.MULTILINE)
    assert re.search(r"^    make environment\n\n%runscript\n", APPTAINER, re.MULTILINE)
    assert "set -- make results" in APPTAINER
    kept = {line for line in (ROOT / ".gitignore").read_text().splitlines() if line.startswith("!/results/")}
    ignored = (ROOT / "containers/Dockerfile.dockerignore").read_text().splitlines()
    assert {line.strip("!/") for line in kept} == {line.strip("!/") for line in ignored if line.startswith("!")}
