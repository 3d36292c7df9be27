"""The results folder of a small run with its page."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from gpca.jobs.provenance import record_provenance
from gpca.page.page import write_page
from gpca.process.processor import describe
from gpca.reporting.figures.style import save_figure, use_style
from gpca.reporting.registry import SUFFIXES
from gpca.reporting.tables.table import Cell, Column, Table
from tests.page.small_run import FIGURES, TABLES, Page, run_of
from tests.page.test_comparison import HEAD, LINES
from tests.page.test_findings import write_intervals


@pytest.fixture(scope="package")
def folder(four, causes, tmp_path_factory):
    """A results folder with all that the page needs."""
    folder = tmp_path_factory.mktemp("results") / "tiny"
    for name in TABLES:
        table = Table(
            name=name,
            caption="Accuracy (%) of <GP-CA> & co., by `gpca`",
            row_heads={"source": "Dataset"},
            rows=((("bricks", "Bricks"),), (("cones", "Cones"),)),
            column_head="explainer",
            columns={"gpca": Column("GP-CA"), "shap": Column("SHAP")},
            cells={(0, "gpca"): Cell(97.7, 0.4, 3, 270), (0, "shap"): Cell(33.3, 2.0, 3, 270)},
            compared=([(0, "gpca"), (0, "shap")],),
            footnotes=("A footnote.",),
        )
        with record_provenance([folder / f"tables/{name}.{suffix}" for suffix in SUFFIXES["tables"]], [], {}):
            table.write(folder / f"tables/{name}")
    use_style()
    import matplotlib.pyplot as plt

    for name in FIGURES:
        figure, panel = plt.subplots()
        panel.plot(np.arange(5))
        save_figure(figure, folder / f"figures/{name}.pdf", folder / f"figures/{name}.png")
    (folder / "comparison.csv").write_text(HEAD + "".join(LINES))
    write_intervals(
        folder / "attribution_intervals.csv", [("bricks", "gpca", "accuracy", 0.9), ("cones", "gpca", "accuracy", 0.75)]
    )
    (folder / "metrics.csv").write_text("")
    replace(causes, registrations=replace(causes.registrations, axes=("four", 100))).save(
        folder / "causes/four/seed100.npz"
    )
    four.save(folder / "objects/four.npz", "four")
    write_page(folder, run_of(folder))
    return folder


@pytest.fixture(scope="package")
def page(folder):
    return Page((folder / "index.html").read_text())


@pytest.fixture
def copied(folder, tmp_path):
    """A copy of the folder, to be damaged, and its run."""
    shutil.copytree(folder.parent, tmp_path / "results")
    copy = tmp_path / "results/tiny"
    (copy / "index.html").unlink()
    return copy, run_of(copy)


@pytest.fixture
def two_runs(tmp_path):
    """The folders of two runs: a table whose row 3 differs and of which the second has a row more, and a figure."""
    folders = tmp_path / "results/one", tmp_path / "results/other"
    for which, folder in enumerate(folders):
        rows = range(12 + which)
        table = Table(
            name="table9_long",
            caption="Accuracy (%)",
            row_heads={"row": "Row"},
            rows=tuple(((f"{row}", f"row {row}"),) for row in rows),
            column_head="metric",
            columns={"accuracy": Column("Accuracy (%)")},
            cells={(row, "accuracy"): Cell(50 + row + 10 * which * (row == 3), 0.4, 3, 270) for row in rows},
        )
        table.write(folder / "tables/table9_long")
        record = {"code": {"commit": ("abc", "def")[which], "dirty": bool(which)}, "python": "3.11", "libraries": {}}
        record |= {"config_sha256": {"seeds": "1", "causes": str(which)}, "environment_lock_sha256": "1"}
        record |= {"device": describe() | {"gpu": None}}
        (folder / "tables/table9_long.csv.provenance.json").write_text(json.dumps(record))
        Image.new("RGB", (4, 4), ("red", "blue")[which]).save(written(folder / "figures/mine.png"))
    (folders[0] / "tables/only_here.md").write_text((folders[0] / "tables/table9_long.md").read_text())
    return folders


def written(path):
    """A path whose folder is there."""
    path.parent.mkdir(exist_ok=True)
    return path
