"""The clouds of README's first commands are those of their script, and are answered as README says."""

import re
from pathlib import Path
from runpy import run_path

import numpy as np

from gpca.model.clouds import read_points
from gpca.model.explainer import Explainer
from gpca.model.location import SHIPPED
from gpca.model.repair import REPAIRED

ROOT = Path(__file__).parent.parent
CLOUDS = ROOT / "examples/clouds"


def test_the_clouds_are_those_of_the_script(tmp_path):
    run_path(str(CLOUDS / "make.py"))["main"](tmp_path)
    for name in ("scan.ply", "model.ply"):
        made, kept = (read_points(folder / name) for folder in (tmp_path, CLOUDS))
        np.testing.assert_allclose(made, kept, atol=1e-6)


def test_the_registration_fails_as_the_docs_say_and_is_repaired():
    source, target = (read_points(CLOUDS / name) for name in ("scan.ply", "model.ply"))
    explainer = Explainer.load(SHIPPED)
    explained = explainer.explain(source, target)
    said = without_numbers(explained.text())
    for page in ("README.md", "docs/explain.md"):
        quoted = ROOT.joinpath(page).read_text().partition("```text\n")[2].partition("```")[0]
        assert set(without_numbers(quoted)) <= set(said), page
    assert (explained.diagnosis.state, explained.diagnosis.named) == ("failed", ("pose", "overlap"))
    assert explainer.repair(source, target).verdict == REPAIRED


def without_numbers(text):
    return re.sub(r"[0-9]+(\.[0-9]+)?", "0", text).splitlines()
