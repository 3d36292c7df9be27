"""What a killed Snakemake has left goes when none of the folder lives, and only then."""

import errno
import fcntl
import os
import subprocess
import sys

import pytest

from gpca.code_files import ROOT
from gpca.config import jobs as restart
from gpca.config.jobs import clear_leftovers

LIVES = """
import sys
from gpca.config.jobs import clear_leftovers
clear_leftovers(sys.argv[1:])
print("lives", flush=True)
sys.stdin.read()
"""
LEFT = (
    "locks/0.input.lock",
    "locks/0.output.lock",
    "scripts/tmp0abc_1.table.py",
    "shadow/tmp123/x",
    "shell_tmp.ab/script.sh",
)
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

    def start(*arguments):
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        process = subprocess.Popen([sys.executable, "-c", LIVES, *arguments], cwd=here, env=environment, **pipes)
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
    clear_leftovers([])
    assert files(here / ".snakemake") == set(KEPT)


def test_a_fresh_folder_has_nothing_to_clear(tmp_path, monkeypatch):
    (tmp_path / "fresh").mkdir()
    monkeypatch.chdir(tmp_path / "fresh")
    clear_leftovers([])
    assert files(tmp_path / "fresh" / ".snakemake") == set()


def test_nothing_of_one_that_lives_is_touched_until_it_was_killed(here, start):
    clear_leftovers([])
    restart._locks.pop().close()
    first, second = start(), start()
    lock = here / ".snakemake/locks/0.output.lock"
    lock.parent.mkdir()
    lock.touch()
    for living in (first, second):
        clear_leftovers([])
        restart._locks.pop().close()
        assert lock.exists()
        living.kill()
        living.wait()
    clear_leftovers([])
    assert not lock.exists()


def test_who_came_second_counts_too(here, start):
    clear_leftovers([])
    start()
    restart._locks.pop().close()
    lock = here / ".snakemake/locks/0.output.lock"
    lock.parent.mkdir()
    lock.touch()
    clear_leftovers([])
    assert lock.exists()


def test_a_job_s_own_snakemake_clears_nothing_but_counts_as_one_that_lives(here, start):
    clear_leftovers([], main=False)
    assert files(here / ".snakemake") == {*LEFT, *KEPT}
    start()
    assert files(here / ".snakemake") == {*LEFT, *KEPT}


def test_where_files_cannot_be_locked_everything_stays(here, monkeypatch):
    def unknown(file, operation):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", unknown)
    clear_leftovers([])
    assert files(here / ".snakemake") == {*LEFT, *KEPT}


def test_temporary_folders_of_killed_runs_go_with_what_is_in_them(here, start):
    folders = [here / name for name in ("snakemakeabcd1234", "snakemake_9_8_7_6", "snakemakeown_own_")]
    for folder in folders:
        folder.mkdir()
        (folder / "content").touch()
    killed, living, own = folders
    process = start(str(killed))
    other = start(str(living))
    process.kill()
    process.wait()
    clear_leftovers([own])
    assert killed.exists()
    restart._locks.pop().close()
    other.kill()
    other.wait()
    clear_leftovers([own])
    assert [folder.exists() for folder in folders] == [False, False, False]
    restart._locks.pop().close()


@pytest.mark.parametrize("name", ["home", "snakemake", "snakemakeabc", "other/snakemakeabcd1234", ".", "..", "/", ""])
def test_a_doctored_record_removes_nothing(here, name):
    path = here / name
    path.mkdir(parents=True, exist_ok=True)
    (here / "snakemakeown_own_").mkdir()
    (here / ".snakemake/running").write_text(f"{path}\n{name}\n../{name}\n")
    clear_leftovers([here / "snakemakeown_own_"])
    assert path.is_dir()
    assert (here / ".snakemake/running").read_text() == f"{here}/snakemakeown_own_\n"


def test_a_link_in_place_of_a_temporary_folder_is_removed_and_what_it_names_is_not(here):
    (here / "home").mkdir()
    (here / "home/letter").touch()
    (here / "snakemakeabcd1234").symlink_to(here / "home")
    (here / ".snakemake/running").write_text(f"{here}/snakemakeabcd1234\n")
    clear_leftovers([here / "snakemakeown_own_"])
    assert (here / "home/letter").exists()
