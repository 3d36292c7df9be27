"""Draws the estimates of the same poses: ellipses over samples, errors over predicted spreads, coverages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.errors import InputError
from gpca.experiments.estimators.covariances import ReferenceSamples
from gpca.experiments.estimators.ellipses import draw_ellipses, style_of
from gpca.experiments.estimators.settings import REFERENCES
from gpca.reporting.figures.panels import label_outer
from gpca.reporting.figures.style import BLACK, GRAY, LIGHT_GRAY, SMALL_PT, TEXT_WIDTH_IN, use_style, write_title
from gpca.seeds import seed_of_file

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

LEVELS = np.linspace(0.01, 0.99, 99)
FEWEST_SAMPLES = 20  # of the reference, that a registration shows
SHOWN = "reference_all"  # the reference whose results are dots
TITLES = dict(zip(REFERENCES, ("Other starts", "Other data", "Other starts and data"), strict=True))


def draw_estimators(
    estimates: Mapping[tuple[str, str, int], pd.DataFrame],
    samples_npz: str | Path,
    estimators: Mapping[str, str],
    methods: Mapping[str, str],
    title: str,
) -> Figure:
    """Draw two registrations above, and all of the first method below.

    Above stand the registration that failed and the one that did not whose error is the median of its kind.

    Args:
        estimates: rows by source, estimator and seed; the references are among the estimators.
        samples_npz: the references' samples of the shown source and seed, which its path names.
    """
    source, seed = Path(samples_npz).parent.name, seed_of_file(samples_npz)
    samples = ReferenceSamples.load(samples_npz)
    method = next(iter(methods))
    titles = TITLES | dict(estimators)
    of_shown = {name: _of_method(estimates, (source, name, seed), method, samples_npz) for name in titles}
    shown = _chosen(of_shown[SHOWN], samples, method, samples_npz)
    pooled = {name: _pooled(estimates, name, method) for name in titles}
    plt = use_style()
    figure = plt.figure(figsize=(TEXT_WIDTH_IN, 5.35), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=(2.1, 3))
    _draw_shown(upper.subplots(1, 2 * len(shown)), shown, samples, of_shown, titles)
    names = [name for name in titles if len(pooled[name])]
    informative = [SHOWN, *(name for name in names if name not in REFERENCES)][:8]
    left, right = lower.subfigures(1, 2, width_ratios=(0.69, 0.31))
    limits = _limits([pooled[name] for name in informative])
    scatters = left.subplots(2, 4, sharex=True, sharey=True).flat
    for panel, name in zip(scatters, informative, strict=False):
        _draw_scatter(panel, pooled[name], titles[name], style_of(name)[0], limits)
    for spare in left.axes[len(informative) :]:
        spare.set_visible(False)
    label_outer(left.axes[: len(informative)], "", "")
    _write(left.axes[0], (0.04, 0.97), "too confident")
    _write(left.axes[0], (0.97, 0.03), "too cautious")
    left.supxlabel("predicted spread (% of the diameter)", fontsize=SMALL_PT)
    left.supylabel("error (% of the diameter)", fontsize=SMALL_PT)
    _draw_coverage(right.subplots(), pooled, names)
    handles = [plt.Line2D([], [], color=style_of(n)[0], linestyle=style_of(n)[1], label=titles[n]) for n in names]
    signs: list[tuple[str, str, dict[str, Any]]] = [
        ("results of other starts and data", ".", {"color": LIGHT_GRAY}),
        ("true pose", "*", {}),
        ("succeeded", "o", {"markerfacecolor": "none", "markersize": 3}),
        ("failed", "x", {"markersize": 3}),
    ]
    handles += [
        plt.Line2D([], [], **({"color": BLACK} | look), marker=marker, linestyle="", label=label)
        for label, marker, look in signs
    ]
    upper.legend(handles=handles, loc="outside upper left", ncols=6, columnspacing=1.2)
    write_title(figure, f"{title}, {methods[method]}: 95 % ellipses over further results; below, all datasets")
    return figure


def _draw_shown(
    panels, shown: Mapping[str, int], samples: ReferenceSamples, of_shown: Mapping, titles: Mapping[str, str]
) -> None:
    """Draw the ellipses of each registration that is shown, in a plane of its rotation and one of its translation.

    Estimators whose ellipses would not fit are named instead.
    """
    parts = {
        "rotation": (slice(0, 3), "degrees", np.rad2deg(1.0)),
        "translation": (slice(3, 6), "% of the diameter", 100.0),
    }
    for panel, ((kind, place), (part, (axes, unit, factor))) in zip(
        panels, product(shown.items(), parts.items()), strict=True
    ):
        estimates = {name: _estimate_of(rows, samples.sample[place]) for name, rows in of_shown.items()}
        left_out = draw_ellipses(panel, samples, place, estimates, axes, factor)
        panel.set_title(f"{kind}: {part}", fontsize=8, pad=3)
        words = "\n".join([f"first axis ({unit})", *(f"far wider: {titles[name]}" for name in left_out)])
        panel.set_xlabel(words, fontsize=SMALL_PT, labelpad=1, linespacing=1.1)
        panel.set_ylabel(f"second axis ({unit})", fontsize=SMALL_PT, labelpad=0)


def coverages(mahalanobis_S: np.ndarray) -> np.ndarray:
    """Return the share of the true poses that lies within the region predicted for each of `LEVELS`."""
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
    enough_S &= samples.kind == SHOWN.removeprefix("reference_")
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


def _estimate_of(rows: pd.DataFrame, sample: int) -> pd.Series | None:
    of_sample = rows[(rows["sample"] == str(sample)) & (rows["failure"] == "")]
    return None if of_sample.empty else of_sample.iloc[0]


def _draw_scatter(panel, rows: pd.DataFrame, title: str, color: str, limits: tuple[float, float]) -> None:
    """Draw errors over predicted spreads; on the diagonal the prediction is right on average."""
    from matplotlib.ticker import FixedLocator, NullLocator

    panel.plot(limits, limits, color=GRAY, linewidth=0.6, zorder=1)
    for failed, marker in ((False, "o"), (True, "x")):
        of_kind = rows[rows["failed"] == failed]
        face = {"facecolors": "none", "edgecolors": color} if marker == "o" else {"color": color}
        where = 100 * np.maximum(of_kind["spread"], 1e-5), 100 * of_kind["add_relative"]
        panel.scatter(*where, s=7, marker=marker, linewidths=0.5, **face)
    panel.set(xscale="log", yscale="log", xlim=limits, ylim=limits)
    panel.set_title(title, fontsize=SMALL_PT, pad=2)
    panel.tick_params(which="both", pad=1.5, length=2)
    decades = 10.0 ** np.arange(np.ceil(np.log10(limits[0])), np.floor(np.log10(limits[1])) + 1)
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(FixedLocator(decades.tolist()))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(NullLocator())


def _draw_coverage(panel, pooled: Mapping, names: Sequence[str]) -> None:
    panel.plot([0, 100], [0, 100], color=GRAY, linewidth=0.6)
    for name in names:
        color, line = style_of(name)
        width = 1.8 if name in REFERENCES else 1.1
        succeeded = ~pooled[name]["failed"].to_numpy()
        if not succeeded.any():
            continue
        shares = 100 * coverages(pooled[name]["mahalanobis"].to_numpy()[succeeded])
        panel.plot(100 * LEVELS, shares, color=color, linestyle=line, linewidth=width)
    panel.set(xlim=(0, 100), ylim=(0, 100))
    panel.set_xlabel("predicted to contain (%)", fontsize=SMALL_PT, labelpad=1)
    panel.set_ylabel("true poses within (%)", fontsize=SMALL_PT, labelpad=1)
    panel.set_title("Coverage, succeeded", fontsize=8, pad=3)
    panel.tick_params(pad=1.5, length=2)
    _write(panel, (0.04, 0.97), "too cautious")  # Curves lie in the other corner.


def _write(panel, place: tuple[float, float], words: str) -> None:
    """Write in a corner of a panel what it means to lie there."""
    across, up = ("left", "top") if place[0] < 0.5 else ("right", "bottom")
    panel.text(*place, words, transform=panel.transAxes, ha=across, va=up, fontsize=SMALL_PT, color=GRAY)


def _limits(tables: Sequence[pd.DataFrame]) -> tuple[float, float]:
    """Return the range, in percent of the diameter, of all errors and spreads."""
    both = np.concatenate([table[["spread", "add_relative"]].to_numpy().ravel() for table in tables])
    low, high = 100 * np.quantile(np.maximum(both, 1e-5), (0.0, 1.0))
    return 0.8 * low, 1.25 * high
