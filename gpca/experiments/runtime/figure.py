"""Draws where the time of one explanation goes, here and in the paper: its stages as rows, on one scale."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from gpca.comparison.published import HARDWARE, Number, printed_seconds
from gpca.errors import InputError
from gpca.model.runtime_file import COMPONENTS, OF_ONE_EXPLANATION
from gpca.reporting.figures.panels import legend_below, panels
from gpca.reporting.figures.style import BLUE, GRAY, GREEN, ORANGE, SMALL_PT, write_title

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

LOOKS = ((GRAY, "D"), (BLUE, "o"), (GREEN, "s"), (ORANGE, "^"))  # the paper's first, then those of our devices
ROW_IN = 0.34
ALL_STAGES = "All four"


class Stage(NamedTuple):
    """The mean time of a stage and its standard deviation over the runs, in ms; the paper prints no deviation."""

    mean: float
    deviation: float = 0.0


def draw_runtime(runtime: pd.DataFrame, title: str, numbers: Iterable[Number]) -> Figure:
    """Draw the mean of every stage of one explanation and of their sum, ours with one standard deviation.

    Args:
        runtime: The frame that :func:`gpca.model.runtime_file.read_runtime` reads.
    """
    series = _stages(runtime, numbers)
    rows = [*(COMPONENTS[component] for component in OF_ONE_EXPLANATION), ALL_STAGES]
    figure, [[panel]] = panels(1, 1, 0.9 + ROW_IN * len(rows))
    step = 0.7 / len(series)
    for place, (name, stages) in enumerate(series.items()):
        color, marker = LOOKS[min(place, len(LOOKS) - 1)]
        drawn = [*stages.values(), Stage(sum(stage.mean for stage in stages.values()))]
        for row, (mean, deviation) in enumerate(drawn):
            y = row + step * (place - (len(series) - 1) / 2)
            # A logarithmic axis has no place for what lies below zero.
            low, high = max(mean - deviation, 0.1 * mean), mean + deviation
            panel.plot([low, high], [y, y], color=color, linewidth=1.0)
            panel.plot(mean, y, marker, color=color, linestyle="", label=name if row == 0 else None)
            words = f"{mean:,.3g}" if mean < 1000 else f"{mean:,.0f}"
            look = {"textcoords": "offset points", "va": "center_baseline", "fontsize": SMALL_PT}
            panel.annotate(words, (high, y), (5, 0), **look)
    panel.margins(x=0.08)  # The last number needs room.
    panel.axhline(len(rows) - 1.5, color=GRAY, linewidth=0.6)
    panel.set_yticks(range(len(rows)), rows)
    panel.set(ylim=(len(rows) - 0.5, -0.5), xscale="log", xlabel="milliseconds")
    panel.xaxis.set_major_formatter("{x:g}")
    panel.tick_params(axis="y", length=0)
    panel.grid(axis="x")
    panel.set_axisbelow(True)
    write_title(figure, f"One explanation on {title}")
    legend_below(figure, *panel.get_legend_handles_labels())
    return figure


def _stages(runtime: pd.DataFrame, numbers: Iterable[Number]) -> dict[str, dict[str, Stage]]:
    """Return the times of the stages by what measured them: the paper, and here without and with a GPU."""
    measured = {
        (row.component, row.device): Stage(1e3 * row.mean_s, 1e3 * row.deviation_s) for row in runtime.itertuples()
    }
    hardware = {row.device: row.hardware for row in runtime.itertuples()}
    printed = printed_seconds(numbers)
    of_paper = {component: Stage(1e3 * printed[component].value) for component in OF_ONE_EXPLANATION}
    series = {f"Paper, {' and '.join(HARDWARE.values())}": of_paper}
    for device, name in hardware.items():
        stages = series.setdefault(f"Here, {name}", {})
        for component in OF_ONE_EXPLANATION:
            stage = measured.get((component, device), measured.get((component, "CPU")))
            if stage is None:
                raise InputError("runtime", f"has no row of '{component}'", "rerun the step 'runtime'")
            stages[component] = stage
    return series
