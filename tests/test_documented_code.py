"""The Python that pages show runs, and says what they say it does."""

import re
import runpy

import numpy as np
import pytest

from gpca.evaluation.conformal import OUTCOMES
from gpca.guarantee.guarantee import STATES

from .documents import ROOT


def run_example(page, registrations, **given):
    """Run the one Python example of a page with the clouds, and what else it takes for granted."""
    text = (ROOT / f"docs/{page}.md").read_text()
    [example] = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    clouds = {"source_points": registrations.cloud(0), "target_points": registrations.target(0)}
    names = clouds | {"T_target_source_init": np.eye(4)} | given
    exec(example, names)
    return names


@pytest.mark.parametrize("page", ["quick_start", "explain"])
def test_the_python_of_a_page_runs(page, model, registrations, tmp_path, monkeypatch, capsys):
    model.save(tmp_path / "model.pt")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GPCA_MODEL", str(tmp_path / "model.pt"))
    run_example(page, registrations)
    assert set(capsys.readouterr().out.split()) & {"nominal", "failed", "noise", "pose", "overlap"}


@pytest.mark.parametrize(("page", "start"), [("registration", "True "), ("estimators", "[[")])
def test_the_python_of_the_pages_of_methods_and_estimators_runs(page, start, registrations, capsys):
    run_example(page, registrations)
    assert capsys.readouterr().out.startswith(start)


def test_the_python_of_the_page_of_guarantees_runs(registrations):
    scores = np.random.default_rng(0).dirichlet(np.ones(4), size=200)
    given = {"scores_N_4": scores, "new_M_4": scores, "family_N": np.arange(200) % 20}
    names = run_example("guarantee", registrations, state_N=np.resize(STATES, 200), **given)
    assert names["same"] == names["guarantee"] and names["inside_M_5"].shape == (200, 5)
    assert set(names["called_M"]) <= set(OUTCOMES)


def test_the_tutorial_runs_to_its_end_and_warns_of_the_foreign_scale(model, tmp_path, monkeypatch, capsys):
    model.save(tmp_path / "model.pt")
    monkeypatch.setenv("GPCA_MODEL", str(tmp_path / "model.pt"))
    runpy.run_path(str(ROOT / "docs/tutorial.py"))
    said = capsys.readouterr().out
    told = [line.split()[0] for line in said.splitlines() if "; noise " in line]
    assert told == ["noise", "pose", "overlap", "both"]
    assert "T_target_source, in m" in said
    assert "warning: the source is 2" in said
