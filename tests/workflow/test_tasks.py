"""A stranger's tasks: the commands that docs/tasks.md points to or shows, run at tiny size, or by the test named.

The other five of those that it shows whole are in tests/tracks/test_tasks.py.
"""

import re
import shlex
import sys
from contextlib import chdir

import yaml

import gpca
from gpca.config.layers import read_file, with_defaults
from tests.steps.by_words import main

from ..documents import ROOT, block, blocks_in, code_in, command_lines, section, tasks_beside_a_clone
from .conftest import Project

SMOKE = ("--configfile", "config/smoke.yaml")
PAGE = ROOT / "docs/tasks.md"
TASKS = re.findall(r"^\| \d+ \| (.+?) \| \[.+?\]\((.+?)#(.+?)\) \|$", PAGE.read_text(), re.MULTILINE)
# What a task begins with -> its command on the page, and the test that runs it. Those without one are below.
ELSEWHERE = {
    "install": ("pip install .", "tests/test_package.py::test_the_command_runs_anywhere"),
    "make one": (
        "snakemake -j2 results/default/tables/table2_per_concept.md",
        "tests/workflow/test_tasks.py::test_a_dataset_of_ones_own_becomes_a_row_in_a_folder_beside_a_clone",
    ),
    "use your own meshes": (
        "snakemake -j2 results/default/tables/table2_per_concept.md --config data_dir=/data",
        "tests/workflow/test_tasks.py::test_a_dataset_of_ones_own_becomes_a_row_in_a_folder_beside_a_clone",
    ),
    "add an explainer": ('EXPLAINERS = {"nearest_quality"', "tests/test_adding.py::test_an_explainer"),
    "continue": (
        "snakemake -j2 all --configfile config/smoke.yaml",
        "tests/workflow/test_determinism.py::test_the_same_command_continues_a_killed_run_and_leaves_nothing_behind",
    ),
}
HERE = ("see", "use depth frames", "explain", "label", "change", "drop", "cite")


def text_of(task):
    """The section of the documentation that a task points to."""
    [(page, anchor)] = [(page, anchor) for name, page, anchor in TASKS if name.startswith(task)]
    return section((PAGE.parent / page).resolve(), anchor)


def command(task, start):
    """The words of the one command of a task that starts so."""
    [found] = [line for line in code_in(text_of(task)) if line.startswith(start)]
    return shlex.split(found)


def test_each_of_the_tasks_is_run_here_or_elsewhere():
    starts = (*ELSEWHERE, *HERE)
    assert {sum(name.startswith(start) for start in starts) for name, *_ in TASKS} == {1}
    assert all(any(name.startswith(start) for name, *_ in TASKS) for start in starts)
    for task, (shown, test) in ELSEWHERE.items():
        assert shown in text_of(task)
        file, name = test.split("::")
        assert f"def {name}(" in (ROOT / file).read_text()


def test_the_smoke_run_is_the_command_of_the_makefile():
    assert command("see", "make smoke") == ["make", "smoke"]
    recipe = re.search(r"^smoke: environment.*\n\t.*? (snakemake .*) \$\(SNAKEMAKE_ARGS\)$", read("Makefile"), re.M)[1]
    rule = read("workflow/rules/targets.smk").split("rule smoke:")[1]
    assert recipe == "snakemake -j$(CORES) all --configfile config/smoke.yaml"
    assert "-j{threads} all --configfile {params.config:q}" in rule  # which the shared run of these tests calls
    assert "config/smoke.yaml" in rule


def read(name):
    return (ROOT / name).read_text()


def test_a_severity_is_changed_an_explainer_dropped_and_a_bop_dataset_named(project, tmp_path):
    configs = {"my_run.yaml": "change", "fewer.yaml": "drop", "my_lab.yaml": "use depth frames"}
    pages = dict.fromkeys(("my_run.yaml", "fewer.yaml"), "docs/reproducing.md") | {"my_lab.yaml": "docs/real_world.md"}
    for name, task in configs.items():
        words = command(task, "snakemake -j2")
        assert words[words.index("--configfile") + 1] == name
        (project.folder / name).write_text(block(name, page=pages[name]))
    assert project.gpca(*command("change", "python -m gpca")[3:]).returncode == 0
    dataset = tmp_path / "lab/bop/my_lab"  # planned here; tests/frames/test_steps.py reads one
    (dataset / "models").mkdir(parents=True)
    for name in ("foundationpose_mylab-test.csv", "models/models_info.json"):
        (dataset / name).touch()
    (dataset / "test/000001").mkdir(parents=True)
    (dataset / "test/000001/scene_gt.json").write_text('{"0": [{"obj_id": 1}]}')
    words = ["all", *SMOKE, *configs, "--config", f"data_dir={tmp_path}/lab"]
    planned = project.plan(*words).stdout
    assert set(re.findall(r"^register +(\d+)$", planned, re.MULTILINE)) == {"6"}  # two sources, three seeds
    changed = with_defaults(*(read_file(project.folder / name) for name in configs))
    assert changed["registrations"]["severities"]["noise"] == [0.01, 0.05]
    assert not re.search("/(shap_oracle|sa_sobol_additive|badge)/", planned)
    assert "/shap_additive/" in planned
    assert "results/my_lab/instances/real_rgbd.npz" in planned
    assert "results/my_lab/scenes/real_rgbd" not in planned
    assert "results/my_lab/registrations/virtual_rgbd/seed10.npz" in planned


def test_a_registration_is_explained(model, registrations, tmp_path, monkeypatch, capsys):
    import trimesh

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GPCA_MODEL", str(tmp_path / "model.pt"))
    model.save(tmp_path / "model.pt")
    for name, points in (("source", registrations.cloud(0)), ("target", registrations.target(0))):
        trimesh.PointCloud(points).export(f"{name}.ply")
    words = command("explain", "python -m gpca explain")
    assert words[:3] == ["python", "-m", "gpca"]
    assert main(words[3:]) == 0
    assert set(capsys.readouterr().out.split()) & {"nominal", "failed"}


def test_samples_are_labelled(smoke, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").symlink_to(smoke.folder / "results")
    (tmp_path / "answers").write_text("overlap\n/quit\n")
    words = [word.replace("/default/", "/smoke/") for word in command("label", "python -m gpca label")[3:]]
    with (tmp_path / "answers").open() as typed:
        monkeypatch.setattr(sys, "stdin", typed)
        assert main(words) == 0
    assert (tmp_path / "my_labels.csv").read_text().count("\n") == 2
    assert "answered" in capsys.readouterr().out


def test_a_dataset_of_ones_own_becomes_a_row_in_a_folder_beside_a_clone(tmp_path, capsys):
    import trimesh

    task = tasks_beside_a_clone()["Use a dataset of your own"]
    (tmp_path / "gp-ca-bench").symlink_to(ROOT)
    for name, text in blocks_in(task):
        (tmp_path / name).write_text(text)
    (tmp_path / "my_parts").mkdir()
    trimesh.creation.box((40, 70, 100)).export(tmp_path / "my_parts/brick.stl")
    trimesh.creation.cone(30, 90).export(tmp_path / "my_parts/cone.ply")
    trimesh.creation.annulus(20, 35, 25).export(tmp_path / "my_parts/ring.obj")
    (gpca_itself, *checked), (snakemake, *made) = map(shlex.split, command_lines(task))
    assert (gpca_itself, snakemake) == ("gpca", "snakemake")
    with chdir(tmp_path):
        assert main(checked) == 0
    assert capsys.readouterr().out == "run my_parts: valid; sources ycb, my_parts; seeds 0\n"
    Project(tmp_path).snakemake(*made)
    [table] = re.findall(r"`(results/my_parts/\S+)`", task)
    assert "\n| My parts |" in (tmp_path / table).read_text()
    assert not (ROOT / "results/my_parts").exists()


def test_the_suite_is_cited_by_a_file_that_names_the_paper_of_the_readme():
    assert "CITATION.cff" in text_of("cite")
    citation = yaml.safe_load(read("CITATION.cff"))
    assert (citation["version"], citation["license"], citation["type"]) == (gpca.__version__, "MIT", "software")
    assert citation["preferred-citation"]["title"] in " ".join(read("README.md").split())
    assert citation["preferred-citation"]["url"] in read("README.md")
    assert all(citation[key] for key in ("cff-version", "message", "title", "authors"))
