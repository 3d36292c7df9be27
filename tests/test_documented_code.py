"""The Python that pages show runs, and says what they say it does."""

import re
import runpy

import numpy as np

from gpca.__main__ import main
from gpca.evaluation.conformal import OUTCOMES
from gpca.guarantee.guarantee import STATES
from gpca.model.location import SHIPPED

from .documents import ROOT


def run_example(page, registrations, **given):
    """Run the one Python example of a page with the clouds, and what else it takes for granted."""
    text = (ROOT / f"docs/{page}.md").read_text()
    [example] = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    clouds = {"source_points": registrations.cloud(0), "target_points": registrations.target(0)}
    names = clouds | {"T_target_source_init": np.eye(4)} | given
    exec(example, names)
    return names


def test_the_python_of_the_page_of_explanations_runs(model, registrations, tmp_path, monkeypatch, capsys):
    model.save(tmp_path / "model.pt")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GPCA_MODEL", str(tmp_path / "model.pt"))
    run_example("explain", registrations)
    assert set(capsys.readouterr().out.split()) & {"nominal", "failed", "noise", "pose", "overlap"}


def test_the_python_of_the_page_of_methods_and_estimators_runs(registrations, capsys):
    run_example("registration", registrations)
    fine, estimate = capsys.readouterr().out.split("\n", 1)
    assert fine.startswith("True ") and estimate.startswith("[[")


def test_the_python_of_the_page_of_guarantees_runs(registrations):
    scores = np.random.default_rng(0).dirichlet(np.ones(4), size=200)
    given = {"scores_N_4": scores, "new_M_4": scores, "family_N": np.arange(200) % 20}
    names = run_example("guarantee", registrations, state_N=np.resize(STATES, 200), **given)
    assert names["same"] == names["guarantee"] and names["inside_M_5"].shape == (200, 5)
    assert set(names["called_M"]) <= set(OUTCOMES)


def test_the_docs_show_what_the_first_command_of_the_readme_answers(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    monkeypatch.setenv("GPCA_MODEL", str(SHIPPED))
    text = (ROOT / "README.md").read_text()
    [command] = re.findall(r"^gpca (explain examples\S+ \S+)$", text, re.MULTILINE)
    assert main(command.split()) == 0
    said = set(capsys.readouterr().out.splitlines())
    for page in (text, (ROOT / "docs/explain.md").read_text()):
        [answer] = re.findall(r"^```text\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
        assert set(answer.splitlines()) <= said


def test_the_tutorial_runs_to_its_end_and_warns_of_the_foreign_scale(model, tmp_path, monkeypatch, capsys):
    model.save(tmp_path / "model.pt")
    monkeypatch.setenv("GPCA_MODEL", str(tmp_path / "model.pt"))
    runpy.run_path(str(ROOT / "docs/tutorial.py"))
    said = capsys.readouterr().out
    told = [line.split()[0] for line in said.splitlines() if "; noise " in line]
    assert told == ["noise", "pose", "overlap", "both"]
    assert "T_target_source, in m" in said
    assert "warning: the source is 2" in said
