"""The package as `pip` builds and installs it: what is inside, and that it runs far from the checkout."""

import os
import shutil
import subprocess
import sys
import zipfile

import pytest
import yaml

import gpca
from gpca.commands.ship import LARGEST_BYTES
from gpca.io.files import sha256_of_file
from gpca.model.explainer import Explainer
from gpca.model.file import Model
from gpca.model.location import SHIPPED
from gpca.process.processor import may_pin

from .documents import ROOT

BUILT_FROM = ("gpca", "baselines", "pyproject.toml", "setup.py", "README.md", "LICENSE")
LIBRARY, COMPILER = "gpca/process/loops.so", shutil.which("cc")


def files_of(folder):
    """The files of both packages, but for what Python and numba write beside them."""
    paths = [path for name in ("gpca", "baselines") for path in (folder / name).rglob("*")]
    return {str(path.relative_to(folder)) for path in paths if path.is_file() and "__pycache__" not in path.parts}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """A wheel, built without the network, of a copy: builds leave files beside their sources."""
    pytest.importorskip("pip")
    sources, out = tmp_path_factory.mktemp("sources"), tmp_path_factory.mktemp("wheel")
    for name in BUILT_FROM:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, sources / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy2(ROOT / name, sources / name)
    pip("wheel", "--no-build-isolation", "--wheel-dir", out, sources)
    [file] = out.iterdir()
    return file


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """A folder with the package and its command, and nothing else."""
    folder = tmp_path_factory.mktemp("installed")
    pip("install", "--target", folder, wheel)
    return folder


def pip(*arguments):
    command = [sys.executable, "-m", "pip", *map(str, arguments), "--quiet", "--no-deps", "--no-index"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def isolated(installed, code, folder, *flags):
    """Run code in another folder by a Python that knows of the installed package, and of no checkout."""
    code = f"import sys; sys.path.insert(0, {str(installed)!r})\n{code}"
    done = subprocess.run([sys.executable, "-I", *flags, "-c", code], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_wheel_holds_every_file_and_says_its_version_license_and_command(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
    assert names - {LIBRARY} == files_of(ROOT) - {LIBRARY}
    assert wheel.name.endswith("-py3-none-linux_x86_64.whl" if LIBRARY in names else "-py3-none-any.whl")
    assert LIBRARY in names or not COMPILER or not may_pin()
    assert ("gpca/model/shipped.pt" in names) == SHIPPED.is_file()
    assert {"gpca/py.typed", "baselines/py.typed"} <= names
    with zipfile.ZipFile(wheel) as archive:
        [metadata] = [name for name in archive.namelist() if name.endswith(".dist-info/METADATA")]
        entry_points = archive.read(metadata.replace("METADATA", "entry_points.txt")).decode()
        text = archive.read(metadata).decode()
    assert wheel.name.startswith(f"gpca_bench-{gpca.__version__}-py3-none-")
    assert f"\nVersion: {gpca.__version__}\n" in text
    assert "\nLicense-Expression: MIT\n" in text
    assert "gpca = gpca.__main__:main" in entry_points


def test_importing_it_needs_no_other_package(installed, tmp_path):
    """Without site-packages, -S, there is no other; what `gpca` offers is loaded when it is asked for."""
    code = "import gpca; print(gpca.__file__, gpca.__version__, len([m for m in sys.modules if m.startswith('gpca')]))"
    out = isolated(installed, code, tmp_path, "-S").split()
    assert out == [str(installed / "gpca/__init__.py"), gpca.__version__, "1"]
    out = isolated(installed, "from gpca.__main__ import main; main(['--version'])", tmp_path, "-S")
    assert out == f"gpca {gpca.__version__}\n"


def test_the_command_runs_anywhere(installed, tmp_path):
    def run(*words):
        command = [installed / "bin/gpca", *words]
        environment = os.environ | {"PYTHONPATH": str(installed), "PYTHONSAFEPATH": "1"}
        environment.pop("GPCA_MODEL", None)
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)

    assert run("--version").stdout == f"gpca {gpca.__version__}\n"
    assert run("--help").stdout.startswith("usage: gpca ")
    missing = run("explain", "a.ply", "b.ply")
    assert missing.returncode == 2
    lost = "b.ply: no such file" if SHIPPED.is_file() else f"no model: none in {tmp_path}/results; "
    assert missing.stderr.startswith(f"gpca explain: {lost}")
    (tmp_path / "run").mkdir()
    missing = run("check-reference", "run")
    assert missing.returncode == 2
    assert missing.stderr == (
        "gpca check-reference: config/config.yaml: no such file; "
        "run this in the folder of the suite, or name the file with --config\n"
    )


def test_a_model_comes_with_its_card_and_no_page_promises_one_that_is_not_there(registrations):
    card = SHIPPED.with_suffix(".md")
    assert card.is_file() == SHIPPED.is_file()
    if SHIPPED.is_file():
        assert SHIPPED.stat().st_size <= LARGEST_BYTES
        assert f"| SHA-256 | `{sha256_of_file(SHIPPED)}` |" in card.read_text()
        model = Model.load(SHIPPED)
        assert not model.stand_in
        source, target = registrations.cloud(0), registrations.target(0)
        assert Explainer(model).explain(source, target).diagnosis.state in ("nominal", "failed")
    assert SHIPPED.is_file() or "with the model that comes with it" not in (ROOT / "README.md").read_text()


def test_its_data_code_and_provenance_are_its_own(installed, tmp_path):
    code = """
import json
from pathlib import Path
from gpca.process.code_files import code_files
from gpca.comparison.published import PUBLISHED, read_published
from gpca.comparison.published import REASONS
from gpca.jobs.provenance import record_provenance
from gpca.reporting.figures.style import MATPLOTLIBRC
from gpca.page.page import TEMPLATES
assert len(read_published())
files = [PUBLISHED, REASONS, MATPLOTLIBRC, TEMPLATES / "index.html.jinja", *code_files("gpca.steps.pairs:attribute")]
for file in files:
    assert Path(file).is_file(), file
    print(file)
with record_provenance([Path("out.csv")], [], {}):
    pass
"""
    files = isolated(installed, code, tmp_path).split()
    assert len(files) > 10
    for file in files:
        assert file.startswith(str(installed)), file
    record = yaml.safe_load((tmp_path / "out.csv.provenance.json").read_text())
    assert record["code"] == {"version": gpca.__version__, "commit": None, "dirty": None}
    assert record["environment_lock_sha256"] is None
