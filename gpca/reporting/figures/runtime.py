"""Draws where the time of one explanation goes, here and in the paper: one stacked bar each, on its own scale."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.comparison.published import HARDWARE, Number, printed_seconds
from gpca.errors import InputError
from gpca.model.runtime_file import COMPONENTS, OF_ONE_EXPLANATION
from gpca.reporting.figures.style import BLUE, GREEN, ORANGE, TEXT_WIDTH_IN, YELLOW, save_figure, use_style, write_title

if TYPE_CHECKING:
    import pandas as pd

COLOURS = dict(zip(OF_ONE_EXPLANATION, (BLUE, ORANGE, GREEN, YELLOW), strict=True))


def draw_runtime(
    runtime: pd.DataFrame, title: str, numbers: Iterable[Number], pdf_path: str | Path, png_path: str | Path
) -> None:
    """Draw the stages of one explanation as stacked bars.

    Args:
        runtime: The frame that :func:`gpca.model.runtime_file.read_runtime` reads.
        title: The title of the objects that were registered.
        numbers: The numbers that the paper prints.
        pdf_path, png_path: The two files to write.

    Raises:
        InputError: A stage was not measured.
    """
    bars = _bars(runtime, numbers)
    use_style()
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(len(bars), 1, figsize=(TEXT_WIDTH_IN, 0.8 + 0.75 * len(bars)), squeeze=False)
    for panel, (name, milliseconds) in zip(panels[:, 0], bars.items(), strict=True):
        left = 0.0
        for component, width in milliseconds.items():
            panel.barh(0, width, left=left, color=COLOURS[component], label=COMPONENTS[component], height=0.6)
            left += width
        panel.set(yticks=[], xlim=(0, 1.02 * left))
        panel.set_title(f"{name}: {left:,.3g} ms" if left < 1000 else f"{name}: {left:,.0f} ms", loc="left")
        panel.spines["left"].set_visible(False)
    panels[-1, 0].set_xlabel("milliseconds; each bar has its own scale")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    write_title(figure, f"One explanation on {title}")
    below_title = 1 - 0.2 / figure.get_size_inches()[1]
    figure.set_layout_engine("constrained", rect=(0, 0, 1, below_title))
    figure.legend(handles, labels, loc="outside lower center", ncol=len(labels))
    save_figure(figure, pdf_path, png_path)


def _bars(runtime: pd.DataFrame, numbers: Iterable[Number]) -> dict[str, dict[str, float]]:
    """Return for each bar the milliseconds of its stages: the paper's, and here without and with a GPU."""
    mean_ms = {(row.component, row.device): 1e3 * row.mean_s for row in runtime.itertuples()}
    hardware = {row.device: row.hardware for row in runtime.itertuples()}
    printed = printed_seconds(numbers)
    bars = {f"Paper, {' and '.join(HARDWARE.values())}": {c: 1e3 * printed[c].value for c in COLOURS}}
    for device, name in hardware.items():
        stages = bars.setdefault(f"Here, {name}", {})
        for component in COLOURS:
            milliseconds = mean_ms.get((component, device), mean_ms.get((component, "CPU")))
            if milliseconds is None:
                raise InputError("runtime", f"has no row of '{component}'", "rerun the step 'runtime'")
            stages[component] = milliseconds
    return bars
