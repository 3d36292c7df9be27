"""What jobs inherit: tested by a job, a Python in another folder."""

import errno
import fcntl
import json
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
import yaml

from gpca.config import jobs as restart
from gpca.config.jobs import clear_leftovers, export_to_jobs
from gpca.process.code_files import ROOT

CONFIG = {"seeds": [0], "data_dir": "data", "comparison": {}, "registrations": {"train": 800, "test": 200}}
VARIABLES = ("GPCA_CONFIG_SHA256", "PATH", "PYTHONPATH", "PYTHONSAFEPATH")


@pytest.fixture(autouse=True)
def environment(monkeypatch):
    """One with nothing of ours in it; what is exported goes when the test ends."""
    for variable in VARIABLES:
        monkeypatch.setenv(variable, "")
    monkeypatch.setenv("PATH", "/usr/bin:/bin")


def job(folder, code):
    done = subprocess.run(["python", "-c", code], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_a_job_in_another_folder_runs_this_python_and_this_code(tmp_path):
    export_to_jobs(CONFIG)
    code = "import sys, gpca, baselines; print(sys.prefix, gpca.__file__, baselines.__file__)"
    expected = [sys.prefix, f"{ROOT}/gpca/__init__.py", f"{ROOT}/baselines/__init__.py"]
    assert job(tmp_path, code) == expected
    (tmp_path / "gpca").mkdir()
    (tmp_path / "gpca/__init__.py").write_text("raise SystemExit('the gpca of another checkout')\n")
    assert job(tmp_path, code) == expected
    done = subprocess.run(["python", "-m", "gpca", "--version"], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.startswith("gpca "), done.stderr


def test_a_job_takes_the_code_of_the_folder_that_is_named(tmp_path):
    (tmp_path / "gpca").mkdir()
    (tmp_path / "gpca/__init__.py").write_text("")
    export_to_jobs(CONFIG, tmp_path)
    assert job(ROOT, "import gpca; print(gpca.__file__)") == [f"{tmp_path}/gpca/__init__.py"]


def test_an_installed_package_is_found_without_pythonpath(monkeypatch):
    """The packages of one Python in the path of another, as of a rule's own environment, would do harm."""
    monkeypatch.setenv("PYTHONPATH", "/other")
    export_to_jobs(CONFIG, sysconfig.get_path("purelib"))
    assert os.environ["PYTHONPATH"] == "/other"


def test_jobs_that_start_jobs_do_not_make_the_paths_longer(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", f"/other{os.pathsep}{ROOT}")
    export_to_jobs(CONFIG)
    first = {variable: os.environ[variable] for variable in VARIABLES}
    export_to_jobs(CONFIG)
    assert {variable: os.environ[variable] for variable in VARIABLES} == first
    assert first["PYTHONPATH"].split(os.pathsep) == [str(ROOT), "/other"]
    assert Path(shutil.which("python")).parent == Path(sys.executable).parent


def test_the_hashes_are_those_of_the_sections_that_results_depend_on():
    whole = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    hashes = []
    for changed in ({}, {"data_dir": "/data"}, {"comparison": {"tolerances": {}}}, {"reference": {}}, {"seeds": [7]}):
        export_to_jobs(dict(reversed((whole | changed).items())))
        hashes.append(os.environ["GPCA_CONFIG_SHA256"])
    assert len(set(hashes[:4])) == 1
    usual, other = json.loads(hashes[0]), json.loads(hashes[4])
    assert {section for section in usual if usual[section] != other[section]} == {"seeds"}
    assert {"registrations", "encoders"} <= set(usual)


LIVES = """
import sys
from gpca.config.jobs import clear_leftovers
clear_leftovers()
print("lives", flush=True)
sys.stdin.read()
"""
LEFT = ("locks/0.input.lock", "locks/0.output.lock")
LEFT += ("scripts/tmp0abc_1.table.py", "shadow/tmp123/x", "shell_tmp.ab/script.sh")
KEPT = ("incomplete/cmVzdWx0", "metadata/cmVzdWx0", "log/one.log", "auxiliary/x")


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """A working folder with Snakemake's state in it; what this process holds is given back at the end."""
    monkeypatch.chdir(tmp_path)
    for name in (*LEFT, *KEPT):
        path = tmp_path / ".snakemake" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    yield tmp_path
    while restart._locks:
        restart._locks.pop().close()


@pytest.fixture
def start(here):
    """Start a process that lives until its stdin is closed or it is killed."""
    started = []

    def start():
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        process = subprocess.Popen([sys.executable, "-c", LIVES], cwd=here, env=environment, **pipes)
        started.append(process)
        assert process.stdout.readline() == b"lives\n"
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()


def files(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()} - {"running"}


def test_what_killed_runs_left_goes_and_what_continues_them_stays(here):
    clear_leftovers()
    assert files(here / ".snakemake") == set(KEPT)


def test_nothing_of_one_that_lives_is_touched_until_it_was_killed(here, start):
    clear_leftovers()
    restart._locks.pop().close()
    first, second = start(), start()
    lock = here / ".snakemake/locks/0.output.lock"
    lock.parent.mkdir()
    lock.touch()
    for living in (first, second):
        clear_leftovers()
        restart._locks.pop().close()
        assert lock.exists()
        living.kill()
        living.wait()
    clear_leftovers()
    assert not lock.exists()


def test_who_came_second_counts_too(here, start):
    clear_leftovers()
    start()
    restart._locks.pop().close()
    lock = here / ".snakemake/locks/0.output.lock"
    lock.parent.mkdir()
    lock.touch()
    clear_leftovers()
    assert lock.exists()


def test_a_job_s_own_snakemake_clears_nothing_but_counts_as_one_that_lives(here, start):
    clear_leftovers(main=False)
    assert files(here / ".snakemake") == {*LEFT, *KEPT}
    start()
    assert files(here / ".snakemake") == {*LEFT, *KEPT}


def test_where_files_cannot_be_locked_everything_stays(here, monkeypatch):
    def unknown(file, operation):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", unknown)
    clear_leftovers()
    assert files(here / ".snakemake") == {*LEFT, *KEPT}
