"""The classifier's kernel, learning rate and number of iterations (Table IV)."""

from collections.abc import Mapping
from dataclasses import dataclass
from operator import contains
from pathlib import Path
from typing import Any

from gpca.attribution.predictions import read_predictions
from gpca.declarations import Experiment, Figure, Frame, Paths, Run, Step, figure, numbers, table
from gpca.errors import InputError
from gpca.evaluation.measures import ALL, Clustered, intervals, read_samples, tidy
from gpca.io.csv_file import numbers as number_column
from gpca.io.csv_file import read_numbers
from gpca.reporting.figures.panels import in_lines, legend_below, panels
from gpca.reporting.figures.style import BLACK, BLUE, COLUMN_WIDTH_IN, GRAY, ORANGE
from gpca.reporting.sheet import Row, Sheet, show
from gpca.settings import Distinct
from gpca.steps.kernel_grid import GRID_COLUMNS, MEASURES, PRINTED, SETTING, KernelGrid

TABLE = "kernels"  # in the column `table`
GRID_FILES = "kernels/{kernel_source}/seed{seed}.csv"


@dataclass(frozen=True, kw_only=True)
class Section(KernelGrid):
    """The grid, and the sources whose embeddings it is fitted to."""

    sources: Distinct[str]


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    grid = config["kernel_grid"]
    axes = [grid[axis] for axis in ("kernels", "learning_rates", "iterations")]
    printed = [setting[0] for setting in PRINTED if all(map(contains, axes, setting))]
    return {"kernel_source": list(grid["sources"]), "printed_kernels": printed}


EXPERIMENT = Experiment(
    name="kernel_grid", sections={"kernel_grid": Section}, names=names, lists={"kernel_grid.sources": "sources"}
)

FIT = Step(
    name="fit_kernel_grid",
    run="gpca.steps.kernel_grid",
    inputs={
        "registrations": "registrations/{source}/seed{*seed}.npz",
        "embeddings": "embeddings/{source}/{embedding}/seed{*seed}.npz",
    },
    outputs={"out": "kernels/{source}/seed{*seed}.csv", "predictions": "kernel_predictions/{source}/seed{*seed}.csv"},
    settings=lambda plan, wildcards: plan.config["kernel_grid"],
    where={"source": "kernel_source"},
    priority=4,
)


def setting_name(kernel: str, learning_rate: float, iterations: int) -> str:
    """E.g. ``rbf-0.01-100``, the column `method`."""
    return f"{kernel}-{learning_rate:g}-{iterations}"


def read_grids(files: Paths) -> Frame:
    """Read files named `…/{source}/seed{seed}.csv` into one frame with the further columns `source` and `seed`."""
    rows = read_samples(files, lambda path: read_numbers(path, GRID_COLUMNS, GRID_COLUMNS[1:]), ("source",))
    return rows.astype({"iterations": int})


@numbers("kernels.csv", files=GRID_FILES)
def collect(run: Run, files: Paths) -> Frame:
    """`MEASURES` of every setting, by seed."""
    records = []
    for row in read_grids(files).itertuples():
        keys = TABLE, row.source, setting_name(row.kernel, row.learning_rate, row.iterations)
        records += [(*keys, measure, ALL, row.seed, float(getattr(row, measure))) for measure in MEASURES]
    return tidy(records, "kernels")


@numbers("kernel_intervals.csv", files="kernel_predictions/{kernel_source}/seed{seed}.csv")
def collect_intervals(run: Run, files: Paths) -> Frame:
    """All measures but the ELBO over all seeds, with intervals over families; a source's settings share the draws."""
    from gpca.attribution.learner_predictions import estimates_of_scores

    def read(path: Path) -> Frame:
        rows = read_predictions(path, SETTING)
        return rows.assign(**{name: number_column(path, rows, name) for name in SETTING[1:]})

    records = []
    answers = read_samples(files, read, ("source",))
    for (source, kernel, rate, iterations), rows in answers.groupby(["source", *SETTING], sort=False):
        samples = Clustered.drawn(rows["seed"], rows["cluster"], "kernel intervals", source)
        estimates = estimates_of_scores(rows, samples)
        keys = TABLE, source, setting_name(kernel, rate, int(iterations))
        records += [samples.record((*keys, name, ALL), estimates[name]) for name in MEASURES if name in estimates]
    return intervals(records, "kernels")


SECTION = "IV-D Ablation studies"
TITLES = {"rbf": "RBF", "matern32": "Matérn 3/2", "polynomial": "Polynomial, p = 2"}
HEADS = {"kernel": "Kernel", "learning_rate": "Rate", "iterations": "Iterations"}


@table(
    SECTION,
    "Table IV: kernel and schedule",
    """Table IV of the paper: accuracy of the Gaussian process classifier in the paper's five combinations of kernel,
    learning rate and iterations.""",
    paper=True,
    needs=("printed_kernels", "kernel_source"),
    intervals="kernel_intervals.csv",
)
def table4_kernels(run: Run, intervals):
    rows = []
    for setting in PRINTED:
        labels = [(setting[0], TITLES[setting[0]]), *((f"{number:g}",) * 2 for number in setting[1:])]
        rows.append(Row(labels, {"method": setting_name(*setting)}))
    columns = {name: show("accuracy", title, where={"source": name}) for name, title in titles(run).items()}
    sheet = Sheet("table4_kernels", HEADS, rows, columns, intervals)
    shown = [name for name in columns if (intervals["source"] == name).any()]
    caption = "Accuracy of the GPC by kernel and schedule (%)" + run.stand_ins(shown)
    cell = next(cell for cell in sheet.cells.values() if cell.test_samples)
    note = "The rows that the paper prints; kernels.csv has all combinations, with confidence and calibration."
    return sheet.table(caption, "source", [f"{sheet.over(cell.test_samples // cell.seeds)}.", note], bold=columns)


@figure(
    SECTION,
    "Accuracy and confidence over iterations",
    """Accuracy and mean confidence of the Gaussian process classifier over its iterations. Matérn's lines are wide, to
    show below RBF's. Circles are the rows of Table IV; filled symbols, drawn to the right, are the accuracies that the
    paper prints for them. It prints no confidence.""",
    grid=(read_grids, GRID_FILES),
)
def kernel_learning_curves(run: Run, grid) -> Figure:
    from matplotlib.lines import Line2D
    from matplotlib.ticker import NullLocator

    shown = {name: title for name, title in titles(run).items() if (grid["source"] == name).any()}
    if not shown:
        raise InputError("kernels", "have no results for these sources", "run them first")
    drawing, axes = panels(len(CURVES), len(shown), 4.05, COLUMN_WIDTH_IN, sharex=True, sharey=True)
    rates = sorted(grid["learning_rate"].unique(), reverse=True)
    ticks = sorted(grid["iterations"].unique())
    for column, (source, title) in enumerate(shown.items()):
        means = grid[grid["source"] == source].groupby([*SETTING])[list(CURVES)].mean()
        for row, measure in enumerate(CURVES):
            panel = axes[row, column]
            by_kernel = means[measure].groupby(level=["kernel", "learning_rate"])
            for (kernel, rate), curve in sorted(by_kernel, key=lambda item: list(WIDTHS).index(item[0][0])):
                look = {"color": COLORS[kernel], "linestyle": LINES[rates.index(rate)], "linewidth": WIDTHS[kernel]}
                panel.plot(curve.index.get_level_values("iterations"), 100 * curve, **look)
            for setting in means.index.intersection(PRINTED, sort=False):
                marker = {"color": COLORS[setting[0]], "markerfacecolor": "white", "markersize": 5}
                panel.plot(setting[2], 100 * means.loc[setting, measure], "o", clip_on=False, zorder=5, **marker)
            for (kernel, rate, iterations), value in printed_accuracies(source).items():
                if measure == "accuracy" and (kernel, rate, iterations) in means.index:
                    filled = {"color": COLORS[kernel], "markersize": 3.5, "clip_on": False}
                    panel.plot(BESIDE[kernel] * iterations, value, PRINTED_MARKERS[int(rate < rates[0])], **filled)
            panel.set_xscale("log")
            panel.set_xticks(ticks, [f"{tick}" for tick in ticks])
            panel.xaxis.set_minor_locator(NullLocator())
            panel.set(xlim=(0.9 * ticks[0], 1.65 * ticks[-1]), ylim=(30, 100))
        axes[0, column].set_title(in_lines(title))
        axes[-1, column].set_xlabel("iterations")
    for row, label in enumerate(CURVES.values()):
        axes[row, 0].set_ylabel(label)
    kernels = [kernel for kernel in COLORS if (grid["kernel"] == kernel).any()]
    looks: list[dict[str, Any]] = [
        *({"label": TITLES[name], "color": COLORS[name], "linewidth": WIDTHS[name]} for name in kernels),
        *({"label": f"rate {rate:g}", "linestyle": line} for rate, line in zip(rates, LINES, strict=False)),
        {"label": "row of Table IV", "marker": "o", "markerfacecolor": "white", "linestyle": ""},
        *(
            {"label": f"paper, rate {rate:g}", "marker": symbol, "linestyle": "", "markersize": 3.5}
            for symbol, rate in zip(PRINTED_MARKERS, rates, strict=False)
        ),
    ]
    legend_below(drawing, [Line2D([], [], **{"color": GRAY} | look) for look in looks], columns=3)
    return drawing


COLORS = {"rbf": BLUE, "matern32": ORANGE, "polynomial": BLACK}
LINES: tuple[Any, ...] = ("-", (0, (4, 2)), ":", "-.")  # from the largest learning rate on
WIDTHS = {"matern32": 2.2, "polynomial": 1.0, "rbf": 1.0}  # the first drawn is the widest, so that all remain visible
PRINTED_MARKERS = ("D", "v")  # at the largest learning rate, and at a smaller one
BESIDE = dict(zip(COLORS, (1.15, 1.32, 1.52), strict=True))  # factor of x; equal printed numbers would coincide
CURVES = {"accuracy": "accuracy (%)", "confidence": "mean confidence (%)"}


def printed_accuracies(source: str) -> dict[tuple[str, float, int], float]:
    """Accuracies of the paper's Table IV for a source, in %, by kernel, learning rate and iterations."""
    from gpca.comparison.published import read_published

    printed = {}
    for number in read_published():
        if number.table == "IV" and number.counterpart and source in number.counterpart.sources:
            kernel, rate, iterations = number.counterpart.methods[0].split("-")
            printed[kernel, float(rate), int(iterations)] = number.value
    return printed


def titles(run: Run) -> dict[str, str]:
    return {name: title for name, title in run.source_titles.items() if name in run.config["kernel_grid"]["sources"]}
