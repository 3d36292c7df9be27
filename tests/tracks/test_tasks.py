"""Five of the tasks that docs/tasks.md shows whole: its own commands in a folder of one's own, and what it promises.

The sixth, a dataset of one's own, runs Snakemake: tests/workflow/test_tasks.py.
"""

import re
import shlex
import shutil

import numpy as np
import pytest

from gpca.__main__ import main
from gpca.tracks.leaderboard import MARK

from ..documents import ROOT, block, command_lines, tasks_beside_a_clone
from ..page.small_run import Page
from .conftest import SOURCE

EXPLAIN, BENCH, SCORE = "Explain two clouds", "Compare your method with the published ones", "Score predictions"
DATASET, COMPARE = "Use a dataset of your own", "Compare two runs"
REPAIR = "Put a wrong registration right"
TASKS = tasks_beside_a_clone()


@pytest.fixture
def folder(tmp_path, monkeypatch, apart):
    """A folder that holds nothing but a clone, of a user without a model or a cache of samples."""
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "gp-ca-bench").symlink_to(ROOT)
    monkeypatch.chdir(folder)
    monkeypatch.delenv("GPCA_MODEL", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return folder


def do(task):
    """Run the commands of a task as the page shows them; tests/test_package.py installs `gpca` itself."""
    for line in command_lines(TASKS[task]):
        program, *words = shlex.split(line)
        assert program == "gpca"
        assert main(words) == 0, line


def test_the_page_shows_six_tasks():
    assert list(TASKS) == [EXPLAIN, REPAIR, BENCH, SCORE, DATASET, COMPARE]
    assert all(command_lines(text) for text in TASKS.values())


def test_two_clouds_are_explained_by_the_packages_model_on_a_page(folder, registrations, capsys):
    import trimesh

    for name, points in (("scan", registrations.cloud(0)), ("model", registrations.target(0))):
        trimesh.PointCloud(0.1 * points).export(f"{name}.ply")  # 10 cm, as the model's objects
    do(EXPLAIN)
    said = capsys.readouterr().out
    [(probably, state)] = re.findall(r"^state +(probably )?(\w+): ", said, re.MULTILINE)
    headline = {"nominal": f"This registration {probably}succeeded", "failed": f"This registration {probably}failed: "}[
        state
    ]
    assert re.search(r"^action +\w+", said, re.MULTILINE)
    page = (folder / "explained.html").read_text()
    for words in (headline, ">Before<", ">After<", "scan.ply", "What to do", *("noise", "pose", "overlap")):
        assert words in page
    assert not re.search(r"https?:|src=", page)


def test_a_registration_that_is_right_keeps_its_pose(folder, registrations, capsys):
    import trimesh

    points = 0.1 * registrations.target(0)
    for name, rows in (("scan", slice(None, None, 2)), ("model", slice(None))):
        trimesh.PointCloud(points[rows]).export(f"{name}.ply")
    do(REPAIR)
    assert capsys.readouterr().out.startswith("repair    good: ")
    np.testing.assert_allclose(np.loadtxt("pose.txt"), np.eye(4), atol=1e-3)


def test_a_method_stands_among_the_published_rows_and_so_do_its_predictions(folder, published, run, tmp_path, capsys):
    (folder / "my_method.py").write_text(block("my_method.py", page="docs/adding.md"))
    shutil.copytree(run, tmp_path / "cache/gpca-bench")  # samples that were made before
    do(BENCH)
    table = capsys.readouterr().out
    assert f"`{MARK.strip()}` marks" in TASKS[BENCH]
    [row] = re.findall(f"^{MARK}.+$", table, re.MULTILINE)
    assert all(f"\n{method.title}  " in table for method in published.methods)
    assert "Minus RMSE below its median (points)" in table
    assert (folder / "predictions.csv").read_text().count(f"\n{SOURCE},") == len(published.rows)
    do(SCORE)
    [again] = re.findall(f"^{MARK}.+$", capsys.readouterr().out, re.MULTILINE)
    assert row.split() == again.split()


def test_two_runs_are_compared_on_a_page(folder, capsys):
    do(COMPARE)
    *tables, _, _, page = capsys.readouterr().out.splitlines()
    assert page == "compare.html"
    assert len(tables) > 20 and all(re.search(r"  (the same|\d+ of \d+ entries differ)", line) for line in tables)
    page = Page((folder / page).read_text())
    assert "Sections of the config that differ" in page.text
    assert page.sources and all((folder / source).is_file() for source in page.sources)
