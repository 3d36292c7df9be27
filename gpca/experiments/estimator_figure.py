"""Estimates of the same poses: ellipses over samples, errors over predicted spreads, coverages."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from gpca.alignment.methods.registry import method_entry
from gpca.declarations.plan import Run
from gpca.declarations.result import Frame, figure
from gpca.errors import InputError
from gpca.experiments.estimator_tables import SECTION
from gpca.reporting.figures import style
from gpca.reporting.figures.panels import label_outer
from gpca.reporting.figures.style import BLACK, GRAY, SMALL_PT
from gpca.seeds import seed_of_file
from gpca.uncertainty.estimates import REFERENCES, ReferenceSamples, covariance_of, read_estimate_files
from gpca.uncertainty.estimators.registry import estimator_entry

LEVELS = np.linspace(0.01, 0.99, 99)
FEWEST_SAMPLES = 20  # of the reference, that a registration shows
SHOWN = "reference_all"  # the reference whose results are dots
TITLES = dict(zip(REFERENCES, ("Other starts", "Other data", "Other starts and data"), strict=True))
STYLES = {  # An estimator has a color and a line everywhere in the figure.
    "reference_starts": (GRAY, (0, (1, 1))),
    "reference_data": (GRAY, (0, (4, 1.5))),
    "reference_all": (GRAY, "-"),
    "monte_carlo": (BLACK, "-"),
    "censi": (style.VERMILION, "-"),
    "bonnabel": (style.VERMILION, (0, (1, 1))),
    "brossard": (style.BLUE, "-"),
    "bayesian_icp": (style.ORANGE, "-"),
    "stein_icp": (style.SKY_BLUE, (0, (4, 1.5))),
    "cello": (style.GREEN, "-"),
    "learned": (style.PURPLE, "-"),
}
OTHER = (style.YELLOW, "-")
TURN = np.linspace(0, 2 * np.pi, 181)
PLANE = 95.0  # percent that an ellipse holds
WIDEST = 2.0  # An ellipse may make a panel this many times as wide as dots and true pose do; a wider one is left out.
PARTS = {
    "rotation": (slice(0, 3), "degrees", np.rad2deg(1.0)),
    "translation": (slice(3, 6), "% of the diameter", 100.0),
}
SIGNS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("results of other starts and data", ".", {"color": style.LIGHT_GRAY}),
    ("true pose", "*", {}),
    ("succeeded", "o", {"markerfacecolor": "none", "markersize": 3}),
    ("failed", "x", {"markersize": 3}),
)


@figure(
    SECTION,
    "What estimators say about the same poses",
    """Above: a registration that succeeded and one that failed. Dots are the results of other starts and data, and the
    axes are the two directions in which they spread most. The origin is the estimated pose and the star the true
    one. Ellipses are the 95 % regions of the references and of the estimators; one more than twice as wide as the
    dots is named instead.

    Below on the left: the error of every registration over the spread that each estimator predicts, the root mean
    square distance by which the points would move. Above the diagonal an estimator is too confident, below it too
    cautious. On the right, for registrations that succeeded: how often the true pose lies within its region of a
    given probability. Here it is the other way round: above the diagonal an estimator is too cautious, below it too
    confident.""",
    name="estimators",
    estimates=(read_estimate_files, "estimates/{source}/{estimate}/seed{seed}.csv"),
    samples_npz="reference_samples/{shown_source}/seed{first_seed}.npz",
)
def draw_estimators(run: Run, estimates, samples_npz):
    """Two registrations above, and all of the first method below.

    Above stand the registration that failed and the one that did not whose error is the median of its kind.
    """
    import pandas as pd

    source, seed = Path(samples_npz).parent.name, seed_of_file(samples_npz)
    samples = ReferenceSamples.load(samples_npz)
    method = next(iter(run.config["estimator_pairs"]["methods"]))
    titles = TITLES | run.titles(estimator_entry, run.config["estimators"])
    of_shown, pooled = {}, {}
    for name in titles:
        if (key := (source, name, seed)) not in estimates:
            fault = f"has no estimates of {source}, seed {seed}"
            raise InputError(samples_npz, fault, "regenerate it from the same config")
        of_shown[name] = estimates[key][estimates[key]["method"] == method]
        rows = pd.concat([each for (_, by, _), each in estimates.items() if by == name], ignore_index=True)
        pooled[name] = rows[(rows["method"] == method) & (rows["failure"] == "")]
    shown = _chosen(of_shown[SHOWN], samples, method, samples_npz)
    plt = style.use_style()
    drawn = plt.figure(figsize=(style.TEXT_WIDTH_IN, 5.35), layout="constrained")
    upper, lower = drawn.subfigures(2, 1, height_ratios=(2.1, 3))
    places = product(shown.items(), PARTS.items())
    for panel, ((kind, place), (part, (block, unit, factor))) in zip(
        upper.subplots(1, 2 * len(shown)), places, strict=True
    ):
        rows_of = {}
        for name, rows in of_shown.items():
            of_sample = rows[(rows["sample"] == str(samples.sample[place])) & (rows["failure"] == "")]
            rows_of[name] = None if of_sample.empty else of_sample.iloc[0]
        left_out = draw_ellipses(panel, samples, place, rows_of, block, factor)
        panel.set_title(f"{kind}: {part}", fontsize=8, pad=3)
        words = "\n".join([f"first axis ({unit})", *(f"far wider: {titles[name]}" for name in left_out)])
        panel.set_xlabel(words, fontsize=SMALL_PT, labelpad=1, linespacing=1.1)
        panel.set_ylabel(f"second axis ({unit})", fontsize=SMALL_PT, labelpad=0)
    names = [name for name in titles if len(pooled[name])]
    informative = [SHOWN, *(name for name in names if name not in REFERENCES)][:8]
    left, right = lower.subfigures(1, 2, width_ratios=(0.69, 0.31))
    both = np.concatenate([pooled[name][["spread", "add_relative"]].to_numpy().ravel() for name in informative])
    low, high = 100 * np.quantile(np.maximum(both, 1e-5), (0.0, 1.0))
    for panel, name in zip(left.subplots(2, 4, sharex=True, sharey=True).flat, informative, strict=False):
        _draw_scatter(panel, pooled[name], titles[name], STYLES.get(name, OTHER)[0], (0.8 * low, 1.25 * high))
    for spare in left.axes[len(informative) :]:
        spare.set_visible(False)
    label_outer(left.axes[: len(informative)], "", "")
    _write(left.axes[0], (0.04, 0.97), "too confident")
    _write(left.axes[0], (0.97, 0.03), "too cautious")
    left.supxlabel("predicted spread (% of the diameter)", fontsize=SMALL_PT)
    left.supylabel("error (% of the diameter)", fontsize=SMALL_PT)
    _draw_coverage(right.subplots(), {name: pooled[name] for name in names})
    handles = []
    for name in names:
        color, line = STYLES.get(name, OTHER)
        handles.append(plt.Line2D([], [], color=color, linestyle=line, label=titles[name]))
    for label, marker, look in SIGNS:
        handles.append(plt.Line2D([], [], **({"color": BLACK} | look), marker=marker, linestyle="", label=label))
    upper.legend(handles=handles, loc="outside upper left", ncols=6, columnspacing=1.2)
    subject = f"{run.source_titles[run.config['figures']['source']]}, {method_entry(method).title}"
    style.write_title(drawn, f"{subject}: 95 % ellipses over further results; below, all datasets")
    return drawn


def _chosen(reference: Frame, samples: ReferenceSamples, method: str, path: str | Path) -> dict[str, int]:
    """Row in the samples of the registration of each kind whose error is the median."""
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


def ellipse(covariance_2_2: np.ndarray) -> np.ndarray:
    """Outline (n, 2) of the ellipse that holds `PLANE` percent of a Gaussian about zero."""
    values_2, axes_2_2 = np.linalg.eigh(covariance_2_2)
    radius = np.sqrt(-2 * np.log(1 - PLANE / 100))
    return radius * np.column_stack([np.cos(TURN), np.sin(TURN)]) * np.sqrt(np.maximum(values_2, 0)) @ axes_2_2.T


def draw_ellipses(
    panel, samples: ReferenceSamples, place: int, estimates: Mapping, block: slice, factor: float
) -> list[str]:
    """Draw one registration in the plane in which the results of other starts and data spread most.

    `block` are the numbers of a twist that are drawn, times `factor`. Returns the estimators whose ellipses are far
    wider than the results and are therefore left out.
    """
    twists_n_3 = factor * samples.twists_of(place)[:, block]
    values_3, axes_3_3 = np.linalg.eigh(np.cov(twists_n_3, rowvar=False))
    plane_3_2 = axes_3_3[:, ::-1][:, :2]
    dots_n_2, true_2 = twists_n_3 @ plane_3_2, factor * samples.true_twist[place, block] @ plane_3_2
    panel.scatter(*dots_n_2.T, s=1.2, color=style.LIGHT_GRAY, linewidths=0, rasterized=True, zorder=1)
    reach = max(np.quantile(np.abs(dots_n_2), 0.985), 2.6 * np.sqrt(max(values_3[-1], 0)), *np.abs(true_2))
    most, left_out = WIDEST * reach, []
    for name, row in estimates.items():
        if row is None:
            continue
        outline_n_2 = ellipse(factor**2 * plane_3_2.T @ covariance_of(row)[block, block] @ plane_3_2)
        if (widest := np.abs(outline_n_2).max()) > most:
            left_out.append(name)
            continue
        reach = max(reach, widest)
        color, line = STYLES.get(name, OTHER)
        look = {"linewidth": 1.8, "zorder": 2} if name in REFERENCES else {"linewidth": 0.9, "zorder": 3}
        panel.plot(*outline_n_2.T, color=color, linestyle=line, **look)
    panel.plot(*true_2, marker="*", color=BLACK, markersize=7, markeredgecolor="white", markeredgewidth=0.5, zorder=4)
    panel.set(xlim=(-1.05 * reach, 1.05 * reach), ylim=(-1.05 * reach, 1.05 * reach), aspect="equal")
    panel.locator_params(nbins=4)
    panel.tick_params(pad=1.5, length=2)
    return left_out


def _draw_scatter(panel, rows: Frame, title: str, color: str, limits: tuple[float, float]) -> None:
    """Draw errors over predicted spreads; on the diagonal the prediction is right on average."""
    from matplotlib.ticker import FixedLocator, NullLocator

    panel.plot(limits, limits, color=GRAY, linewidth=0.6, zorder=1)
    for failed, marker, face in (
        (False, "o", {"facecolors": "none", "edgecolors": color}),
        (True, "x", {"color": color}),
    ):
        of_kind = rows[rows["failed"] == failed]
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


def coverages(mahalanobis_S: np.ndarray) -> np.ndarray:
    """Share of the true poses that lies within the region predicted for each of `LEVELS`."""
    from scipy.stats import chi2

    return (mahalanobis_S[:, None] <= chi2.ppf(LEVELS, 6)).mean(axis=0)


def _draw_coverage(panel, rows_of: Mapping[str, Frame]) -> None:
    panel.plot([0, 100], [0, 100], color=GRAY, linewidth=0.6)
    for name, rows in rows_of.items():
        succeeded = rows[~rows["failed"].to_numpy()]
        if len(succeeded):
            color, line = STYLES.get(name, OTHER)
            shares = 100 * coverages(succeeded["mahalanobis"].to_numpy())
            width = 1.8 if name in REFERENCES else 1.1
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
