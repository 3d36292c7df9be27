"""Table IV and the curves over iterations."""

import pandas as pd
import pytest

from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.evaluation.measures import COLUMNS
from gpca.experiments import kernel_grid
from gpca.steps.kernel_grid import GRID_COLUMNS, PRINTED


def run(stand_in=False, **titles):
    titles = titles or {"linemod": "LINEMOD", "ycb": "YCB"}
    sources = {name: {"title": title, "stand_in": stand_in} for name, title in titles.items()}
    return Run({"sources": sources, "kernel_grid": {"sources": list(titles)}})


REAL, LINEMOD = run(), run(linemod="LINEMOD")


def grid(sources=("ycb", "linemod"), seeds=3):
    """Accuracy rises with iterations, by a point per seed, and is 10 points lower on LINEMOD."""
    rows = [
        (kernel, rate, iterations, 0.8 + iterations / 2000 + 0.01 * seed - 0.1 * (source == "linemod"), -1.0, 0.5, 0.3,
         0.4, source, seed)
        for source in sources
        for seed in range(seeds)
        for kernel in ("rbf", "matern32", "polynomial")
        for rate in (0.01, 0.001)
        for iterations in (50, 100, 200)
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=[*GRID_COLUMNS, "source", "seed"])


def intervals(sources=("ycb", "linemod"), seeds=3):
    """The same measures over the seeds."""
    rows = []
    keys = ["source", "kernel", "learning_rate", "iterations"]
    for (source, *setting), mean in grid(sources, seeds).groupby(keys, sort=False).mean().iterrows():
        for measure in ("accuracy", "confidence", "ece", "nll"):
            own = ("kernels", source, kernel_grid.setting_name(*setting), measure, "all", seeds, 11, seeds * 200)
            rows.append((*own, mean[measure], mean[measure] - 0.05, mean[measure] + 0.02))
    return pd.DataFrame(rows, columns=[*COLUMNS])


def test_table4_has_the_papers_rows_and_a_column_per_source():
    table = kernel_grid.table4_kernels(REAL, intervals())
    assert [tuple(key for key, _ in labels) for labels in table.rows] == [
        (kernel, f"{rate:g}", str(iterations)) for kernel, rate, iterations in PRINTED
    ]
    assert list(table.columns) == ["linemod", "ycb"]
    assert "| RBF | 0.01 | 100 | 76.0 (71.0 to 78.0) | 86.0 (81.0 to 88.0) |" in table.markdown()
    assert "| Matérn 3/2 | 0.01 | 200 | **81.0 (76.0 to 83.0)** | **91.0 (86.0 to 93.0)** |" in table.markdown()


def test_what_was_not_fitted_is_left_out_stand_ins_are_said_and_nothing_to_show_is_a_fault():
    part = intervals(("ycb",))
    table = kernel_grid.table4_kernels(REAL, part[~part["method"].str.endswith("-200")])
    assert list(table.columns) == ["ycb"]
    assert len(table.rows) == 1
    text = kernel_grid.table4_kernels(REAL, intervals(seeds=1)).markdown()
    assert "85.0 (80.0 to 87.0)" in text and "Over 1 seed, 200 test samples each" in text
    table = kernel_grid.table4_kernels(run(stand_in=True), intervals())
    assert "on procedural stand-ins" in table.caption
    with pytest.raises(InputError, match="has nothing to show"):
        kernel_grid.table4_kernels(REAL, intervals(("cups",)))


def test_the_figure_has_the_accuracies_that_the_paper_prints():
    printed = kernel_grid.printed_accuracies("linemod")
    assert set(printed) == set(PRINTED)
    assert printed["rbf", 0.001, 200] == 50.6
    figure = kernel_grid.kernel_learning_curves(LINEMOD, grid())
    drawn = [
        sorted(line.get_ydata()[0] for line in panel.get_lines() if line.get_marker() in kernel_grid.PRINTED_MARKERS)
        for panel in figure.axes
    ]
    assert drawn == [sorted(printed.values()), []]  # accuracies; the paper prints no confidence
    # A kernel whose curve coincides with another's shows below it.
    lines = [line for line in figure.axes[0].get_lines() if len(line.get_xdata()) > 1]
    widths = {line.get_color(): line.get_linewidth() for line in lines}
    assert widths[kernel_grid.COLORS["matern32"]] > widths[kernel_grid.COLORS["rbf"]]
    assert lines[0].get_color() == kernel_grid.COLORS["matern32"]
    with pytest.raises(InputError, match="have no results for these sources"):
        kernel_grid.kernel_learning_curves(run(cups="Cups"), grid())
