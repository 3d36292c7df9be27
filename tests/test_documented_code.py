"""The Python that pages show runs, and says what they say it does."""

import re
import runpy

import numpy as np
import pytest

from .documents import ROOT


def run_example(page, registrations):
    """Run the one Python example of a page with the clouds that it takes for granted."""
    text = (ROOT / f"docs/{page}.md").read_text()
    [example] = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    clouds = {"source_points": registrations.cloud(0), "target_points": registrations.target(0)}
    exec(example, clouds | {"T_target_source_init": np.eye(4)})


@pytest.mark.parametrize("page", ["quick_start", "explain"])
def test_the_python_of_a_page_runs(page, model, registrations, tmp_path, monkeypatch, capsys):
    model.save(tmp_path / "model.pt")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GPCA_MODEL", str(tmp_path / "model.pt"))
    run_example(page, registrations)
    assert set(capsys.readouterr().out.split()) & {"nominal", "failed", "noise", "pose", "overlap"}


def test_the_python_of_the_page_of_registration_methods_runs(registrations, capsys):
    run_example("registration", registrations)
    assert capsys.readouterr().out.startswith("True ")


def test_the_tutorial_runs_to_its_end_and_warns_of_the_foreign_scale(model, tmp_path, monkeypatch, capsys):
    model.save(tmp_path / "model.pt")
    monkeypatch.setenv("GPCA_MODEL", str(tmp_path / "model.pt"))
    runpy.run_path(str(ROOT / "docs/tutorial.py"))
    said = capsys.readouterr().out
    told = [line.split()[0] for line in said.splitlines() if "; noise " in line]
    assert told == ["noise", "pose", "overlap", "both"]
    assert "T_target_source, in m" in said
    assert "warning: the source is 2" in said


def test_the_python_of_the_page_of_estimators_runs(registrations, capsys):
    run_example("estimators", registrations)
    assert capsys.readouterr().out.startswith("[[")
