"""Copies of the project in which Snakemake runs, so that no test touches the results of the working folder."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import pytest

from benchmarks.kills import results
from gpca.process.code_files import FOLDER

from . import forks

ROOT = Path(__file__).resolve().parents[2]
NEEDED = ("Snakefile", "config", "gpca", "baselines", "workflow", "profiles", "environment.lock")


# The rules that nearly every other one leads to.
ENDS = (
    *("comparison", "claims", "page", "reading", "reading_values", "readings", "table13_readings"),
    *("judge_joint", "table16_joint_reading", "verdicts"),
)


def without_ends(jobs):
    """The jobs less those of `ENDS`."""
    return {rule: count for rule, count in jobs.items() if rule not in ENDS}


@dataclass(frozen=True)
class DryRun:
    """What Snakemake would do: how many jobs of each rule (`all` left out), and the files that they write.

    Attributes:
        plan: rule, inputs and outputs of every job, in the order in which they would run.
        messages: what was said besides.
    """

    jobs: Counter
    outputs: set[str]
    plan: tuple[tuple[str, set[str], set[str]], ...]
    messages: str

    def remade(self, *paths):
        """The files that are made again once these have changed."""
        changed = {*paths}
        for _, inputs, outputs in self.plan:
            if inputs & changed:
                changed |= outputs
        return changed - {*paths}

    def behind(self, *paths):
        """How many jobs of each rule read one of the files, or what comes of it."""
        remade = self.remade(*paths)
        return Counter(rule for rule, _, outputs in self.plan if outputs & remade)

    def needed(self, path):
        """The files that are made on the way to the file, and it."""
        needed = {path}
        for _, inputs, outputs in reversed(self.plan):
            if outputs & needed:
                needed |= inputs | outputs
        return needed & self.outputs


@dataclass(frozen=True)
class Project:
    """A copy of the project."""

    folder: Path

    def snakemake(self, *arguments, check=True):
        """Run Snakemake and its jobs in forks of a process that has loaded the libraries."""
        return self._checked(forks.run(["-m", "snakemake", *map(str, arguments)], self.folder, _environment()), check)

    def snakemake_as_processes(self, *arguments, check=True):
        """Run Snakemake and its jobs as users do, each a process that loads its libraries."""
        return self.python("-m", "snakemake", *arguments, check=check)

    def plan(self, *arguments, check=True):
        """Run Snakemake dry."""
        return self.snakemake("-n", *arguments, check=check)

    def gpca(self, *arguments, check=True):
        return self.python("-m", "gpca", *arguments, check=check)

    def dry_run(self, *arguments):
        done = self.plan(*arguments)
        counts = re.findall(r"^(\w+) +(\d+)$", done.stdout, flags=re.MULTILINE)
        jobs = Counter({rule: int(count) for rule, count in counts if rule not in ("all", "total")})
        plan = []
        for job in re.split(r"^(?:local)?rule ", done.stdout, flags=re.MULTILINE)[1:]:
            files = {
                name: set(paths.split(", ")) for name, paths in re.findall(r"^    (input|output): (.+)$", job, re.M)
            }
            inputs = {path for each in files.get("input", ()) for path in (each, *self.stamped(each))}
            plan.append((job.split(":")[0], inputs, files.get("output", set())))
        outputs = {path for _, _, written in plan for path in written}
        return DryRun(jobs, outputs, tuple(plan), done.stderr)

    def stamped(self, path):
        """The files of code that a stamp among the inputs stands for."""
        lines = (self.folder / path).read_text().splitlines() if path.startswith(f"{FOLDER}/") else ()
        return [line.split("  ", 1)[1] for line in lines]

    def start(self, *arguments):
        """Start Snakemake as the leader of a process group of its own."""
        command = [sys.executable, "-m", "snakemake", *map(str, arguments)]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        return subprocess.Popen(command, cwd=self.folder, env=_environment(), start_new_session=True, **quiet)

    def append(self, path, text):
        with (self.folder / path).open("a", encoding="utf-8") as file:
            file.write(text)

    def copy(self, folder):
        """Copy everything, results and Snakemake's memory of them included."""
        shutil.copytree(self.folder, folder, symlinks=True)
        return Project(folder)

    def results(self, *suffixes):
        """The paths and bytes of all results with one of the suffixes; seconds and memory differ from run to run."""
        whole = results(self.folder / "results/smoke")
        return {name: content for name, content in whole.items() if name.endswith(suffixes)}

    def python(self, *arguments, check):
        done = subprocess.run(
            [sys.executable, *map(str, arguments)], cwd=self.folder, env=_environment(), capture_output=True, text=True
        )
        return self._checked(done, check)

    @staticmethod
    def _checked(done, check):
        assert not check or done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]
        return done


def _environment():
    """No other copy of the modules, nothing from a run around this one, no GPU (its sums differ from run to run).

    Nothing listens where the proxies point to: a test that needs the network fails.
    """
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("GPCA_", "PYTHONPATH"))}
    nowhere = dict.fromkeys(("http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY"), "http://127.0.0.1:9")
    return kept | nowhere | {"CUDA_VISIBLE_DEVICES": "", "OMP_NUM_THREADS": "1"}


def _sources_copied(origin, folder):
    # Other tests may be running: what Python and numba are about to write beside the modules is gone before it is read.
    unfinished = shutil.ignore_patterns("*.pyc.*", "*.tmp.*")
    for name in NEEDED:
        # With their times, so that what numba has compiled beside the modules still counts.
        if (origin / name).is_dir():
            shutil.copytree(origin / name, folder / name, ignore=unfinished)
        else:
            shutil.copy2(origin / name, folder / name)
    (folder / "data").symlink_to(ROOT / "data")  # only read, and as large as all the rest
    return Project(folder)


@pytest.fixture
def project(tmp_path):
    """A fresh copy without results."""
    return _sources_copied(ROOT, tmp_path)


@pytest.fixture(scope="session")
def planned(tmp_path_factory):
    """The whole smoke run, planned in a copy without results."""
    project = _sources_copied(ROOT, tmp_path_factory.mktemp("planned"))
    return project.dry_run("all", "--configfile", "config/smoke.yaml")


def pytest_collection_modifyitems(items):
    """First are the tests without a run, last those that wait for the run which was killed beside the others."""
    items.sort(key=lambda item: (_waits(item), "smoke_and_again" in item.fixturenames))


def _waits(item):
    return "killed_and_continued" in getattr(item, "fixturenames", ())


@pytest.fixture(scope="session")
def smoke_and_again(request, tmp_path_factory):
    """The smoke run, and a part of it once more that goes on beside the tests, where one of them asks for it."""
    project = _sources_copied(ROOT, tmp_path_factory.mktemp("smoke"))
    project.snakemake("-j2", "smoke")
    with ThreadPoolExecutor(1) as beside:
        asked = any(_waits(item) for item in request.session.items)
        folder = tmp_path_factory.mktemp("killed")
        yield project, beside.submit(_killed_and_continued, project, folder) if asked else None


@pytest.fixture(scope="session")
def smoke(smoke_and_again):
    """A copy in which the smoke run is complete; shared, so it is only read."""
    return smoke_and_again[0]


@pytest.fixture
def finished(smoke, tmp_path):
    """A copy of the complete smoke run, to be edited."""
    return smoke.copy(tmp_path / "finished")


# What leads to predictions; of explainers and designs one of each kind, with the designs that these read.
STAGES = {"objects", "registrations", "encoders", "embeddings", "causes"}
INTERRUPTED = {"gpca", "residuals_forest", "shap_removal", "removal"}
INTERRUPTED |= {"icp", "dgcnn", "causes"}  # as timings name them
OF_ONE_EACH = {"predictions", "diagnoses", "uncertainty", "timings"}


def is_interrupted(path):
    """Whether the run that is killed and continued makes the file: those of one source."""
    names = {part.removeprefix("uncertainty_").removeprefix("diagnoses_") for part in Path(path).parts}
    return "ycb" in path and bool(names & INTERRUPTED if names & OF_ONE_EACH else names & STAGES)


@dataclass(frozen=True)
class Continued:
    """One source of the smoke run once more, one job at a time, killed in the first training and then continued.

    Attributes:
        locks: how many of Snakemake's locks the killed run left.
        second: what the same command said while the first was living.
    """

    project: Project
    locks: int
    second: subprocess.CompletedProcess


@pytest.fixture(scope="session")
def killed_and_continued(smoke_and_again):
    """That run, which went on beside the other tests."""
    return smoke_and_again[1].result()


def _killed_and_continued(smoke, folder):
    project = _sources_copied(smoke.folder, folder)
    names = smoke.results(".npz", ".pt", ".csv", ".png")
    targets = [f"results/smoke/{name}" for name in names if is_interrupted(name)]
    run = ("-j1", *targets, "--configfile", "config/smoke.yaml")
    process = project.start(*run)
    while process.poll() is None and not list(project.folder.glob("results/smoke/encoders/*/*/*.checkpoint")):
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGSTOP)  # it lives and gets no further, however long the second takes to start
    second = project.snakemake_as_processes(*run, check=False)
    os.killpg(process.pid, signal.SIGKILL)
    assert process.wait() != 0
    assert not list(project.folder.glob("results/smoke/predictions/**/*.csv"))
    locks = len(list(project.folder.glob(".snakemake/locks/*")))
    project.snakemake(*run)
    return Continued(project, locks, second)
