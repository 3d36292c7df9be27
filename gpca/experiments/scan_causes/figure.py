"""Draws by which cause natural registrations of scans failed, by how much the scans overlap."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gpca.causes.scans import GLOBAL, LADDER
from gpca.causes.truth import BORDERLINE, GEOMETRY, NOMINAL
from gpca.errors import InputError
from gpca.experiments.scan_causes.metrics import EVERY, NATURAL, TRUTH
from gpca.experiments.scan_causes.tables import counted, stratum_in_words
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.panels import in_lines, legend_below, panels
from gpca.reporting.figures.style import CONCEPT_COLORS, GRAY, LIGHT_GRAY, SKY_BLUE, SMALL_PT, TEXT_WIDTH_IN
from gpca.reporting.tables.cells import rows_where

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

STARTS = {f"{NATURAL}_{LADDER}": "started on the ladder", f"{NATURAL}_{GLOBAL}": "started by a global method"}
PARTS = {  # what became of a registration -> label, color
    NOMINAL: ("nominal", SKY_BLUE),
    BORDERLINE: ("borderline", LIGHT_GRAY),
    GEOMETRY: ("without a cause", GRAY),
    **{concept: (f"failed by {concept}", CONCEPT_COLORS[concept]) for concept in CONCEPTS},
}
ROW_IN = 0.30


def draw_scan_failures(measured: pd.DataFrame, scans: Mapping[str, str]) -> Figure:
    """Draw a panel for each data set and kind of start, in it a bar for each stratum of overlap, and their numbers.

    Args:
        measured: What :func:`gpca.experiments.scan_causes.metrics.read_scan_causes` returned.
        scans: Titles of the data sets.
    """
    of_truth = rows_where(measured, method=TRUTH)
    strata = sorted(set(of_truth["stratum"]) - {EVERY})
    shown = [
        (name, condition)
        for name in scans
        for condition in STARTS
        if len(rows_where(of_truth, source=name, condition=condition))
    ]
    if not shown:
        raise InputError("causes of scans", "has no natural registrations of these data sets", "run them first")
    columns = len({condition for _, condition in shown})
    lines = [name for name in scans if any(name == of for of, _ in shown)]
    height_in = 0.9 + len(lines) * (0.45 + ROW_IN * len(strata))
    figure, grid = panels(len(lines), columns, height_in, TEXT_WIDTH_IN, sharex=True, sharey=True)
    conditions = [condition for condition in STARTS if any(condition == of for _, of in shown)]
    parts = [part for part in PARTS if _is_there(measured, shown, strata, part)]
    for (line, column), panel in np.ndenumerate(grid):
        name, condition = lines[line], conditions[column]
        panel.set_title(in_lines(f"{scans[name]}, {STARTS[condition]}", 48), fontsize=SMALL_PT)
        for place, stratum in enumerate(strata):
            of = counted(measured, name, condition, stratum)
            if of:
                _draw_bar(panel, place, of, parts)
        panel.set_yticks(range(len(strata)), [stratum_in_words(stratum) for stratum in strata])
        panel.set_xlim(0, 100)
        panel.tick_params(labelsize=SMALL_PT)
    for panel in grid[:, 0]:
        panel.set_ylabel("overlap", fontsize=SMALL_PT)
    for panel in grid[-1]:
        panel.set_xlabel("registrations (%)", fontsize=SMALL_PT)
    legend_below(figure, _handles(parts), columns=3, fontsize=SMALL_PT)
    return figure


def _is_there(measured: pd.DataFrame, shown: list[tuple[str, str]], strata: list[str], part: str) -> bool:
    return any(counted(measured, *place, stratum).get(part, 0) for place in shown for stratum in strata)


def _draw_bar(panel, place: int, counts: Mapping[str, int], parts: list[str]) -> None:
    left, whole = 0.0, counts["registrations"]
    for part in parts:
        share = 100 * counts[part] / whole
        panel.barh(place, share, left=left, color=PARTS[part][1], height=0.75, linewidth=0)
        if share >= 6:
            color = "white" if PARTS[part][1] == GRAY else "black"
            look = {"ha": "center", "va": "center", "fontsize": SMALL_PT, "color": color}
            panel.text(left + share / 2, place, str(counts[part]), **look)
        left += share


def _handles(parts: list[str]) -> list:
    from matplotlib.patches import Patch

    return [Patch(color=color, label=label) for label, color in (PARTS[part] for part in parts)]
