"""The clouds of README's first commands are those of their script, and are answered as README says."""

from pathlib import Path
from runpy import run_path

import numpy as np

from gpca.model.clouds import read_points
from gpca.model.explainer import Explainer
from gpca.model.location import SHIPPED
from gpca.model.repair import REPAIRED

CLOUDS = Path(__file__).parent.parent / "examples/clouds"


def test_the_clouds_are_those_of_the_script(tmp_path):
    run_path(str(CLOUDS / "make.py"))["main"](tmp_path)
    for name in ("scan.ply", "model.ply"):
        made, kept = (read_points(folder / name) for folder in (tmp_path, CLOUDS))
        np.testing.assert_allclose(made, kept, atol=1e-6)


def test_the_registration_fails_as_readme_says_and_is_repaired():
    source, target = (read_points(CLOUDS / name) for name in ("scan.ply", "model.ply"))
    explained = Explainer.load(SHIPPED).explain(source, target, repair=True)
    assert (explained.diagnosis.state, explained.diagnosis.named) == ("failed", ("pose", "overlap"))
    assert explained.repaired.verdict == REPAIRED
