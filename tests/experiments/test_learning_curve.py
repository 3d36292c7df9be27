"""The learning curve: collected numbers, and the figure."""

import numpy as np
import pandas as pd
import pytest

from gpca.causes.judged import CEILING
from gpca.declarations.plan import Run
from gpca.evaluation.measures import TIDY_COLUMNS
from gpca.experiments.learning_curve import CURVE_COLUMNS, MEASURED, collect, learning_curve, read_curves
from gpca.io.csv_file import write_csv


def run(**sources):
    entries = {name: {"title": title, "kind": "procedural"} for name, title in sources.items()}
    return Run({"sources": entries})


def test_curves_are_collected_as_means_over_the_orders_and_drawn(tmp_path, same_bytes):
    random = np.random.default_rng(0)
    keys = [(CEILING, 0, 0), *((name, size, i) for size in (20, 24) for i in (0, 1) for name in ("trees", "gpca"))]
    curve = pd.DataFrame([(*key, *random.random(len(MEASURED))) for key in keys], columns=list(CURVE_COLUMNS))
    write_csv(tmp_path / "four/seed100.csv", curve)
    rows = collect(run(), [tmp_path / "four/seed100.csv"])
    assert tuple(rows.columns) == TIDY_COLUMNS
    trees = rows[(rows["method"] == "trees") & (rows["metric"] == "regret") & (rows["concept"] == "24")]
    expected = curve[(curve["learner"] == "trees") & (curve["samples"] == 24)]["regret"].mean()
    assert trees["value"].tolist() == pytest.approx([expected], abs=1e-5)
    curves = read_curves([tmp_path / "four/seed100.csv"])
    same_bytes(lambda: learning_curve(run(four="Four"), curves))
    accuracy, _ = learning_curve(run(four="Four"), curves).axes
    assert accuracy.get_ylim() == (0, 100)
    assert "guessing" in [line.get_label() for line in accuracy.get_lines()]
