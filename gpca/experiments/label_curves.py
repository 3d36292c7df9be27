"""Learning curves: accuracy over labels as lines of panels, and numbers of labels as cells of tables."""

from collections.abc import Callable, Collection, Mapping
from itertools import product
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from gpca.active_learning.curves import CENSORED_BY, read_curves
from gpca.declarations import Figure, Frame, Paths
from gpca.errors import InputError
from gpca.evaluation.intervals import mean_interval
from gpca.evaluation.measures import source_method_seed
from gpca.pairs.dataset import Registrations
from gpca.reporting.figures import style
from gpca.reporting.figures.panels import fitting_columns, legend_below, panels
from gpca.reporting.sheet import Cell, Show, cell_of_repeats, plural, span, where
from gpca.reporting.tables.cells import cautious_cell
from gpca.seeds import seed_of_file

MOST_LINES = 6  # in a panel; of more, none can be followed
STYLES = {  # the paper's two strategies are thick, with their intervals; an unknown one has the style _OTHER
    "bald_kmeans": (style.BLUE, "-", 1.8),
    "random": (style.BLACK, "-", 1.8),
    "random_stratified": (style.BLACK, ":", 0.9),
    "bald": (style.BLUE, "--", 0.9),
    "bald_stochastic": (style.SKY_BLUE, "-", 0.9),
    "entropy": (style.VERMILION, "-.", 0.9),
    "margin": (style.ORANGE, "-", 0.9),
    "badge": (style.GREEN, "-", 0.9),
    "coreset": (style.PURPLE, "-", 0.9),
    "typiclust": (style.GREEN, "--", 0.9),
}
_OTHER = (style.GRAY, "-", 0.9)


def draw_curves(
    curves: Mapping[tuple[str, str, str], Frame],
    sources: Mapping[str, str],
    rows: Mapping[str, str],
    lines: Mapping[str, str],
    styles: Mapping[str, tuple],
    target: float,
) -> Figure:
    """Draw curves as lines of panels; a row of more than `MOST_LINES` becomes several, each with the thick lines.

    Args:
        curves: of :func:`mean_curves`, by source, row and line.
        sources, rows, lines: title of each name, in order; those without curves are left out.
        styles: color, dashes and width of a line; it has an interval where the width is above 1.
        target: accuracy that a dashed line marks.
    """
    shown = {key for key in curves if key[0] in sources and key[1] in rows and key[2] in lines}
    if not shown:
        raise InputError("active learning", "has no curve of these sources and strategies", "run it first")
    present = map(set, zip(*shown, strict=True))
    columns, settings, across = (
        [name for name in names if name in there] for names, there in zip((sources, rows, lines), present, strict=True)
    )
    down: list[tuple[str, list[str]]] = []
    for name in settings:
        drawn = [line for line in across if any(key[1:] == (name, line) for key in shown)]
        if len(drawn) <= MOST_LINES:
            down.append((name, drawn))
            continue
        always = [line for line in drawn if styles.get(line, _OTHER)[2] > 1][: MOST_LINES - 1]
        others = [line for line in drawn if line not in always]
        groups = -(-len(others) // (MOST_LINES - len(always)))
        down += [(name, [*always, *map(str, part)]) for part in np.array_split(others, groups)]
    aim = f"target ({100 * target:g} %)"
    ordered = [*(lines[line] for line in across), aim]
    below = -(-len(ordered) // fitting_columns(ordered, style.TEXT_WIDTH_IN))
    height_in = 0.42 + 0.2 * below + (1.5 if len(down) < 4 else 1.25) * len(down)
    alike = len({curves[key]["labels"].iloc[-1] for key in shown}) == 1
    figure, axes = panels(len(down), len(columns), height_in, sharex=True if alike else "row", sharey=True)
    for (name, group), row in zip(down, axes, strict=True):
        for source, panel in zip(columns, row, strict=True):
            panel.axhline(100 * target, color=style.GRAY, linewidth=0.6, linestyle=(0, (4, 3)), label=aim)
            for line in reversed(group):
                if (source, name, line) in shown:
                    curve, (color, dashes, width) = curves[source, name, line], styles.get(line, _OTHER)
                    panel.plot(curve["labels"], curve["mean"], dashes, color=color, linewidth=width, label=lines[line])
                    if width > 1:
                        bounds = (curve[bound].clip(0, 100) for bound in ("low", "high"))
                        panel.fill_between(curve["labels"], *bounds, color=color, alpha=0.15, linewidth=0)
            if len(panel.get_lines()) == 1:
                panel.text(0.5, 0.5, "no curve", transform=panel.transAxes, ha="center", va="center", color=style.GRAY)
            panel.margins(x=0.01)
        row[0].set_ylabel(f"accuracy (%)\n{rows[name]}", fontsize=style.SMALL_PT)
    for column, source in enumerate(columns):
        axes[0, column].set_title(sources[source])
        axes[-1, column].set_xlabel("labels")
    handles = {line.get_label(): line for panel in axes.flat for line in panel.get_lines()}
    legend_below(figure, [handles[title] for title in ordered], ordered)
    seeds = {count for key in shown for count in curves[key]["seeds"]}
    style.write_title(figure, f"Means over {plural(span(seeds), 'seed')}")
    return figure


def mean_curves(curve_files: Paths, held_out: Collection[str] | None = None) -> dict[tuple[str, str, str], Frame]:
    """Curves of accuracy in % by source, strategy and setting: labels, mean, low, high, number of seeds.

    The mean is over the concepts held out (all by default), then over the seeds, as are the intervals; of one seed they
    are NaN. Numbers of labels at which some seed has no accuracy are left out.
    """
    import pandas as pd

    parts: dict[tuple[str, str, str], list] = {}
    for path in curve_files:
        source, strategy, seed = source_method_seed(path)
        for (setting, concept), curve in read_curves(path).items():
            if held_out is None or concept in held_out:
                parts.setdefault((source, strategy, setting), []).append(curve.assign(seed=seed))
    means = {}
    for key, curves in parts.items():
        by_seed = pd.concat(curves).groupby(["labels", "seed"])["accuracy"].mean()
        seeds = len(by_seed.index.unique("seed"))
        rows = [
            (labels, *(100 * np.array(mean_interval(part))), len(part))
            for labels, part in by_seed.groupby(level="labels")
            if len(part) == seeds
        ]
        means[key] = pd.DataFrame(rows, columns=["labels", "mean", "low", "high", "seeds"])
    return means


COUNT: dict[str, Any] = {"decimals": 0, "limits": (0, inf), "least_is_best": True, "factor": 1}
OVER_TEST_SAMPLES = ("final_accuracy", "final_accuracy_new", "area_under_curve")
Clusters = Mapping[tuple[str, int], int]  # (source, seed) -> number of families of the test samples


def families(files: Paths) -> Clusters:
    """Number of families of the test samples in files named ``…/{source}/seed{seed}.npz``."""
    counts = {}
    for path in files:
        axes = Path(path).parent.name, seed_of_file(path)
        registrations = Registrations.load(path, axes)
        counts[axes] = len(np.unique(registrations.cluster[registrations.rows("test")]))
    return counts


def quantity(metric: str, title: str, method: str = "", concept: str = "", **options: Any) -> Show:
    """Column of a metric of all rows, or of one strategy or one concept held out."""
    wanted = {"metric": metric, "method": method, "concept": concept}
    return Show(title, where={key: name for key, name in wanted.items() if name}, **options)


def label_cells(test: int, clusters: Clusters) -> Callable[[Frame, Show], Cell | None]:
    """How cells are made: means over the concepts held out that the rows have, then over the seeds.

    Args:
        test: number of test samples of a seed.
        clusters: numbers of clusters of these, which widen the interval of an accuracy, if there are any.
    """

    def cell(rows: Frame, column: Show) -> Cell | None:
        metric, chosen = column.where["metric"], where(rows, column.where)
        values_R = column.factor * chosen.groupby("seed")["value"].mean()
        if clusters and metric in OVER_TEST_SAMPLES:
            drawn = product(chosen["source"].unique(), map(int, values_R.index))
            return cautious_cell(values_R, test * len(values_R), sum(clusters[each] for each in drawn))
        done = where(rows, {**column.where, "metric": CENSORED_BY.get(metric)})["value"]
        return cell_of_repeats(values_R, test * len(values_R), at_least=bool((done < 1).any()))

    return cell
