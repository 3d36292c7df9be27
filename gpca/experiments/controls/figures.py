"""Draws accuracy against the severity of the perturbations, and from each source to each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError
from gpca.experiments.controls.settings import PAPER, TRANSFER
from gpca.experiments.controls.severity import REGISTRATION
from gpca.reporting.figures.panels import (
    draw_percentages,
    in_lines,
    label_outer,
    panels,
    panels_in_lines,
)
from gpca.reporting.figures.style import GRAY, SMALL_PT, write_title
from gpca.reporting.tables.cells import rows_where

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

PARTS = (  # concept, column of its lower bounds, what it is called, factor to the unit that is shown
    ("noise", "low", "noise: deviation\n(% of the diameter)", 100.0),
    ("overlap", "low", "overlap: points\ncut off (%)", 100.0),
    ("pose", "low", "pose: rotation\n(°)", 1.0),
    ("pose", "other_low", "pose: translation\n(% of the diameter)", 100.0),
)
SUCCEEDS = "registration succeeds"
SAMPLES = "number of samples"
ROW_IN, HEAD_IN = 0.24, 0.95
LETTERS = 34  # in a line of an explainer's title


def draw_severity_curves(severities: pd.DataFrame, explainers: Mapping[str, str], title: str) -> Figure:
    """Draw the accuracy in bins of severity as matrices with numbers, since curves would lie on each other at 100 %.

    Rows are the registrations that succeed and the explainers. Columns are the bins of noise and overlap, and for pose
    those of its rotation whatever the translation, and of its translation whatever the rotation.

    Args:
        severities: What :func:`gpca.experiments.controls.severity.collect` returned.
    """
    shown = [name for name in explainers if (severities["method"] == name).any()]
    if not shown:
        raise InputError("severities", "have none of these explainers", "run the controls first")
    parts = [part for part in PARTS if (severities["concept"] == part[0]).any()]
    figure, [drawn] = panels(1, len(parts), HEAD_IN + ROW_IN * (len(shown) + 2), sharey=True)
    for panel, (concept, low, label, factor) in zip(drawn, parts, strict=True):
        of_concept = severities[severities["concept"] == concept]
        columns = {
            method: _binned(of_concept[of_concept["method"] == method], low) for method in (REGISTRATION, *shown)
        }
        _draw_matrix(panel, columns, factor)
        panel.set_title(label, fontsize=SMALL_PT)
    names = [SAMPLES, SUCCEEDS, *("\n".join(wrap(explainers[name], LETTERS)) for name in shown)]
    drawn[0].set_yticks(range(len(names)), names, fontsize=SMALL_PT, linespacing=1.0)
    write_title(figure, f"{title}: accuracy and success (%) by severity")
    return figure


def _binned(rows: pd.DataFrame, low: str) -> pd.DataFrame:
    """Return the `value` in % and the number of `samples` by the bin of one severity, over all bins of the other."""
    weighted = rows.assign(value=100 * rows["value"] * rows["samples"], low=rows[low], high=rows[_high(low)])
    sums = weighted.groupby("low").agg({"value": "sum", "samples": "sum", "high": "first"})
    return sums.assign(value=sums["value"] / sums["samples"])


def _high(low: str) -> str:
    return low.replace("low", "high")


def _draw_matrix(panel, binned: Mapping[str, pd.DataFrame], factor: float) -> None:
    """Draw the numbers of samples as the first row, and below it a row of shares for each method."""
    first = binned[REGISTRATION] if len(binned[REGISTRATION]) else next(bins for bins in binned.values() if len(bins))
    shares_R_B = np.array([bins["value"].reindex(first.index).to_numpy(float) for bins in binned.values()])
    draw_percentages(panel, np.vstack([np.full(len(first), np.nan), shares_R_B]), "{:.0f}")
    for column, samples in enumerate(first["samples"]):
        panel.text(column, 0, f"{samples:.0f}", ha="center", va="center", fontsize=SMALL_PT, color=GRAY)
    panel.axhline(1.5, color="white", linewidth=2)  # Below it are the explainers.
    edges = factor * np.r_[first.index, first["high"].iloc[-1]]
    panel.set_xticks(np.arange(len(edges)) - 0.5, [f"{edge:.4g}" for edge in edges])
    panel.tick_params(labelsize=SMALL_PT, length=0)
    panel.spines[:].set_visible(False)


def draw_transfer(intervals: pd.DataFrame, sources: Mapping[str, str], explainers: Mapping[str, str]) -> Figure:
    """Draw a matrix for each explainer: rows are the sources that it learned from, columns those that it explains.

    Args:
        intervals: What :func:`gpca.experiments.controls.metrics.collect_intervals` returned.
    """
    accuracy = rows_where(intervals, metric="accuracy")
    moved = rows_where(accuracy, control=TRANSFER)
    shown = [name for name in explainers if (moved["method"] == name).any()]
    if not shown:
        raise InputError("intervals", "have no transfer", "run the controls of two sources first")
    figure, drawn = panels_in_lines(len(shown), 1.5)
    names = _short(list(sources.values()))
    for panel, name in zip(drawn, shown, strict=True):
        shares = _matrix(rows_where(accuracy, method=name), list(sources))
        draw_percentages(panel, shares, "{:.0f}")
        panel.set_title(in_lines(explainers[name]), fontsize=SMALL_PT)
        panel.set_xticks(range(len(names)), names, rotation=40, ha="right", rotation_mode="anchor")
        panel.set_yticks(range(len(names)), names)
        panel.tick_params(length=0, labelsize=SMALL_PT)
        panel.set_box_aspect(1)
    label_outer(drawn, "tested on", "learned from")
    bar = figure.colorbar(drawn[0].images[0], ax=figure.axes, shrink=0.5, aspect=30, pad=0.01)
    bar.set_label("accuracy (%)", fontsize=SMALL_PT)
    return figure


def _short(titles: Sequence[str]) -> list[str]:
    """Return the titles without what stands in brackets, where that still tells them apart."""
    short = [title.split(" (")[0] for title in titles]
    return short if len(set(short)) == len(short) else list(titles)


def _matrix(accuracy: pd.DataFrame, sources: list[str]) -> np.ndarray:
    shares = np.full((len(sources), len(sources)), np.nan)
    for row, trained_on in enumerate(sources):
        for column, tested in enumerate(sources):
            control = PAPER if row == column else TRANSFER
            tests = rows_where(accuracy, control=control, source=tested, trained_on=trained_on)
            if len(tests):
                shares[row, column] = 100 * tests["value"].iloc[0]
    return shares
