"""The benchmark that kills a run again and again, with a command in place of Snakemake that ends when it is told to."""

import csv
import fcntl
import json
import random
import sys
from types import SimpleNamespace

import pytest

from benchmarks import kills

from .documents import ROOT

HALF = "results/smoke/.seed0.partial.npz"


@pytest.fixture
def snakemake(monkeypatch, tmp_path):
    """Stand in for the runs: each entry of `ends` says whether that start got to its end; `spoil` is done there."""
    state = SimpleNamespace(ends=[], delays=[], spoil=lambda folder: None)

    def start(command, folder, delay_s):
        state.delays.append(delay_s)
        ended = delay_s is None or state.ends.pop(0)
        for name in ("results/smoke/metrics.csv", "results/smoke/timings.csv", HALF):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text("made" if name.endswith("metrics.csv") else f"{tmp_path}/{len(state.delays)}")
        if ended:
            (folder / HALF).unlink()
            if folder.name == "killed":
                state.spoil(folder)
        return ended

    monkeypatch.setattr(kills, "start", start)
    return state


@pytest.fixture
def run(tmp_path, snakemake, capsys):
    def run():
        status = kills.main(["--kills", "3", "--longest", "9", "--folder", str(tmp_path / "work")])
        return status, json.loads(capsys.readouterr().out.splitlines()[-1])

    return run


def test_there_are_as_many_kills_as_asked_for_and_every_run_that_ends_is_compared(run, snakemake, tmp_path):
    snakemake.ends, snakemake.spoil = [False, True, False, False], lambda folder: None
    status, found = run()
    assert (status, found) == (0, {"kills": 3, "runs": 2, "files": 1, "differing": 0, "left": 0})
    seeded = random.Random(0)
    assert snakemake.delays == [None, *(seeded.uniform(0, 9) for _ in range(4)), None]
    assert not (tmp_path / "work").exists()


def byte(folder):
    (folder / "results/smoke/metrics.csv").write_text("mad3")


def one_file_more(folder):
    (folder / "results/smoke/more.csv").touch()


def half_a_file(folder):
    (folder / HALF).touch()


def lock(folder):
    (folder / ".snakemake/locks").mkdir(parents=True)
    (folder / ".snakemake/locks/0.input.lock").touch()


@pytest.mark.parametrize(
    ("spoil", "differing", "left"), [(byte, 1, 0), (one_file_more, 1, 0), (half_a_file, 1, 1), (lock, 0, 1)]
)
def test_what_differs_or_is_left_is_counted_and_kept_to_be_looked_at(run, snakemake, tmp_path, spoil, differing, left):
    snakemake.ends, snakemake.spoil = [False] * 3, spoil
    status, found = run()
    assert (status, found["differing"], found["left"]) == (1, differing, left)
    assert (tmp_path / "work/killed").is_dir()


CHILD = """
import fcntl, sys, time
file = open("{path}", "w")
fcntl.flock(file, fcntl.LOCK_EX)
print("locked", flush=True)
time.sleep(60)
file.write("survived")
"""


def test_a_kill_ends_the_whole_process_group(tmp_path):
    child = [sys.executable, "-c", CHILD.format(path=tmp_path / "held")]
    command = [sys.executable, "-c", f"import subprocess; subprocess.run({child!r})"]
    delay_s, log = 0.5, tmp_path / "snakemake.log"
    while not log.is_file() or log.read_text() != "locked\n":  # until the child had started before the kill
        assert not kills.start(command, tmp_path, delay_s)
        delay_s *= 2
    with (tmp_path / "held").open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # the child's, until it is dead or has ended
        assert file.read() == ""


def test_what_differs_from_run_to_run_is_what_shows_seconds_and_the_docs_say_so():
    shown = set()
    for path in (ROOT / "results/reference/default").rglob("*.csv"):
        with path.open(newline="") as file:
            if any("second" in cell for row in csv.reader(file) for cell in row):
                shown.add(path.stem)
    assert "table17_scans" in shown
    assert shown <= {*kills.DRAWN_FROM_IT, *(name.removesuffix(".csv") for name in kills.MEASURED)}
    said = (ROOT / "results/README.md").read_text().split("## What is the same in every run")[1].split("\n## ")[0]
    assert {name for name in (*shown, *kills.DRAWN_FROM_IT) if name not in said} == set()
