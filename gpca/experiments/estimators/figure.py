"""Draws what estimators say of the same poses: ellipses over samples, errors over predicted spreads, coverages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.errors import InputError
from gpca.experiments.estimators.covariances import REFERENCE, ReferenceSamples
from gpca.experiments.estimators.ellipses import draw_ellipses, style_of
from gpca.reporting.figures.style import (
    BLACK,
    GREY,
    LIGHT_GREY,
    SMALL_PT,
    TEXT_WIDTH_IN,
    save_figure,
    use_style,
    write_title,
)
from gpca.seeds import seed_of_file

if TYPE_CHECKING:
    import pandas as pd

LEVELS = np.linspace(0.01, 0.99, 99)
FEWEST_SAMPLES = 20  # of the reference, that a registration shows


def draw_estimators(
    estimates: Mapping[tuple[str, str, int], pd.DataFrame],
    samples_npz: str | Path,
    estimators: Mapping[str, str],
    methods: Mapping[str, str],
    title: str,
    pdf_path: str | Path,
    png_path: str | Path,
) -> None:
    """Draw two registrations above, and all of the first method below.

    Above stand the registration that failed and the one that did not whose error is the median of its kind.

    Args:
        estimates: rows by source, estimator and seed; the reference is among the estimators.
        samples_npz: the reference's samples of the shown source and seed, which its path names.
        estimators, methods: the title of each name, in order.

    Raises:
        InputError: an unusable file, or files that do not belong together.
    """
    source, seed = Path(samples_npz).parent.name, seed_of_file(samples_npz)
    samples = ReferenceSamples.load(samples_npz)
    method = next(iter(methods))
    titles = {REFERENCE: "Reference", **estimators}
    of_shown = {name: _of_method(estimates, (source, name, seed), method, samples_npz) for name in titles}
    shown = _chosen(of_shown[REFERENCE], samples, method, samples_npz)
    pooled = {name: _pooled(estimates, name, method) for name in titles}
    plt = use_style()
    figure = plt.figure(figsize=(TEXT_WIDTH_IN, 5.35))
    panels = figure.add_gridspec(1, 4, left=0.065, right=0.995, top=0.875, bottom=0.63, wspace=0.5)
    for column, (kind, place) in enumerate(shown.items()):
        for part, (block, unit, factor) in enumerate(
            (("rotation", "degrees", np.rad2deg(1.0)), ("translation", "% of the diameter", 100.0))
        ):
            panel = figure.add_subplot(panels[0, 2 * column + part])
            said = {name: _said(of_shown[name], samples.sample[place]) for name in titles}
            axes = slice(0, 3) if block == "rotation" else slice(3, 6)
            draw_ellipses(panel, samples, place, said, axes, factor)
            panel.set_title(f"{kind}: {block}", fontsize=8, pad=3)
            panel.set_xlabel(f"first axis ({unit})", fontsize=SMALL_PT, labelpad=1)
            panel.set_ylabel(f"second axis ({unit})", fontsize=SMALL_PT, labelpad=0)
    names = [name for name in titles if len(pooled[name])]
    told = [name for name in names if name != REFERENCE] or names
    of_scatter = figure.add_gridspec(2, 4, left=0.065, right=0.675, top=0.545, bottom=0.075, wspace=0.1, hspace=0.2)
    limits = _limits([pooled[name] for name in told])
    for i, name in enumerate([REFERENCE, *(name for name in told if name != REFERENCE)][:8]):
        panel = figure.add_subplot(of_scatter[i // 4, i % 4])
        _draw_scatter(panel, pooled[name], titles[name], style_of(name)[0], limits, i % 4 == 0, i >= 4)
        if i == 0:
            _write(panel, (0.04, 0.97), "too confident")
            _write(panel, (0.97, 0.03), "too cautious")
    figure.text(0.37, 0.005, "predicted spread (% of the diameter)", ha="center", va="bottom", fontsize=SMALL_PT)
    figure.text(0.003, 0.31, "error (% of the diameter)", ha="left", va="center", rotation=90, fontsize=SMALL_PT)
    _draw_coverage(figure.add_axes((0.74, 0.075, 0.245, 0.47)), pooled, names)
    handles = [plt.Line2D([], [], color=style_of(n)[0], linestyle=style_of(n)[1], label=titles[n]) for n in names]
    signs: list[tuple[str, str, dict[str, Any]]] = [
        ("the reference's results", ".", {"color": LIGHT_GREY}),
        ("true pose", "*", {}),
        ("succeeded", "o", {"markerfacecolor": "none", "markersize": 3}),
        ("failed", "x", {"markersize": 3}),
    ]
    handles += [
        plt.Line2D([], [], **({"color": BLACK} | look), marker=marker, linestyle="", label=label)
        for label, marker, look in signs
    ]
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, 0.972), ncols=6, columnspacing=1.2)
    write_title(figure, f"{title}, {methods[method]}: 95 % ellipses over the reference's results; below, all datasets")
    save_figure(figure, pdf_path, png_path)


def coverages(mahalanobis_S: np.ndarray) -> np.ndarray:
    """Return which share of the true poses lies within what is said to hold each of `LEVELS`."""
    from scipy.stats import chi2

    return (mahalanobis_S[:, None] <= chi2.ppf(LEVELS, 6)).mean(axis=0)


def _of_method(rows: Mapping, key: tuple, method: str, samples_npz: str | Path) -> pd.DataFrame:
    if key not in rows:
        raise InputError(
            samples_npz, f"has no estimates of {key[0]}, seed {key[2]}", "regenerate it from the same config"
        )
    return rows[key][rows[key]["method"] == method]


def _pooled(rows: Mapping, name: str, method: str) -> pd.DataFrame:
    """Return the estimates of all sources and seeds by one estimator, those that failed left out."""
    import pandas as pd

    of_name = [of_file for (_, estimator, _), of_file in rows.items() if estimator == name]
    joined = pd.concat(of_name, ignore_index=True)
    return joined[(joined["method"] == method) & (joined["failure"] == "")]


def _chosen(reference: pd.DataFrame, samples: ReferenceSamples, method: str, path: str | Path) -> dict[str, int]:
    """Return the row in the samples of the registration of each kind whose error is the median."""
    enough_S = (np.diff(samples.offsets) >= FEWEST_SAMPLES) & (samples.method == method)
    place_of = {str(samples.sample[i]): int(i) for i in np.flatnonzero(enough_S)}
    known = reference[reference["sample"].isin(list(place_of))]
    if known.empty:
        raise InputError(path, f"has no results of '{method}'", "regenerate it from the same config")
    shown = {}
    for kind, failed in (("Succeeded", False), ("Failed", True)):
        of_kind = known[known["failed"] == failed].sort_values("add_relative")
        if len(of_kind):
            shown[kind] = place_of[of_kind.iloc[len(of_kind) // 2]["sample"]]
    return shown


def _said(rows: pd.DataFrame, sample: int) -> pd.Series | None:
    told = rows[(rows["sample"] == str(sample)) & (rows["failure"] == "")]
    return None if told.empty else told.iloc[0]


def _draw_scatter(panel, rows: pd.DataFrame, title: str, colour: str, limits, left: bool, below: bool) -> None:
    """Draw errors over predicted spreads; on the diagonal the prediction is right on average."""
    from matplotlib.ticker import FixedLocator, NullLocator

    panel.plot(limits, limits, color=GREY, linewidth=0.6, zorder=1)
    for failed, marker in ((False, "o"), (True, "x")):
        of_kind = rows[rows["failed"] == failed]
        face = {"facecolors": "none", "edgecolors": colour} if marker == "o" else {"color": colour}
        where = 100 * np.maximum(of_kind["spread"], 1e-5), 100 * of_kind["add_relative"]
        panel.scatter(*where, s=7, marker=marker, linewidths=0.5, **face)
    panel.set(xscale="log", yscale="log", xlim=limits, ylim=limits)
    panel.set_title(title, fontsize=SMALL_PT, pad=2)
    panel.tick_params(which="both", pad=1.5, length=2, labelleft=left, labelbottom=below)
    decades = 10.0 ** np.arange(np.ceil(np.log10(limits[0])), np.floor(np.log10(limits[1])) + 1)
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(FixedLocator(decades.tolist()))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(NullLocator())


def _draw_coverage(panel, pooled: Mapping, names: Sequence[str]) -> None:
    panel.plot([0, 100], [0, 100], color=GREY, linewidth=0.6)
    for name in names:
        colour, line = style_of(name)
        width = 1.8 if name == REFERENCE else 1.1
        shares = 100 * coverages(pooled[name]["mahalanobis"].to_numpy())
        panel.plot(100 * LEVELS, shares, color=colour, linestyle=line, linewidth=width)
    panel.set(xlim=(0, 100), ylim=(0, 100))
    panel.set_xlabel("said to hold (%)", fontsize=SMALL_PT, labelpad=1)
    panel.set_ylabel("true poses within (%)", fontsize=SMALL_PT, labelpad=1)
    panel.set_title("Coverage", fontsize=8, pad=3)
    panel.tick_params(pad=1.5, length=2)
    _write(panel, (0.04, 0.97), "too cautious")  # Curves lie in the other corner.


def _write(panel, place: tuple[float, float], words: str) -> None:
    """Say in a corner of a panel what it means to lie there."""
    across, up = ("left", "top") if place[0] < 0.5 else ("right", "bottom")
    panel.text(*place, words, transform=panel.transAxes, ha=across, va=up, fontsize=SMALL_PT, color=GREY)


def _limits(tables: Sequence[pd.DataFrame]) -> tuple[float, float]:
    """Return the range, in per cent of the diameter, of all errors and spreads."""
    both = np.concatenate([table[["spread", "add_relative"]].to_numpy().ravel() for table in tables])
    low, high = 100 * np.quantile(np.maximum(both, 1e-5), (0.0, 1.0))
    return 0.8 * low, 1.25 * high
