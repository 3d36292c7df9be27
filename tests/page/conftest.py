"""The results folder of a small run with its page."""

import shutil

import numpy as np
import pytest

from gpca.page.page import write_page
from gpca.process.provenance import record_provenance
from gpca.reporting.figures.style import save_figure, use_style
from gpca.reporting.registry import SUFFIXES
from gpca.reporting.tables.table import Cell, Column, Table
from tests.page.small_run import FIGURES, TABLES, Page, run_of
from tests.page.test_comparison import HEAD, LINES
from tests.page.test_findings import write_metrics


@pytest.fixture(scope="package")
def folder(registrations, predicted, tmp_path_factory):
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
    write_metrics(folder / "metrics.csv", [("bricks", "gpca", "accuracy", 0.9), ("cones", "gpca", "accuracy", 0.75)])
    predicted(registrations, folder)
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
