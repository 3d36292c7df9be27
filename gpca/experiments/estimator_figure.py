"""Estimates of the same poses: errors over predicted spreads, and coverages."""

from collections.abc import Mapping
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
from gpca.uncertainty.estimates import REFERENCES, read_estimate_files
from gpca.uncertainty.estimators.registry import estimator_entry

LEVELS = np.linspace(0.01, 0.99, 99)
SHOWN = "reference_all"  # the reference that has a panel
TITLES = dict(zip(REFERENCES, ("Other starts", "Other data", "Other starts and data"), strict=True))
STYLES: dict[str, tuple[str, Any]] = {  # An estimator has a color and a line everywhere in the figure.
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
SIGNS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("succeeded", "o", {"markerfacecolor": "none", "markersize": 3}),
    ("failed", "x", {"markersize": 3}),
)


@figure(
    SECTION,
    "What estimators say about the same poses",
    """Left: the error of every registration over the spread that each estimator predicts, the root mean square distance
    by which the points would move. Above the diagonal an estimator is too confident, below it too cautious. Right, for
    registrations that succeeded: how often the true pose lies within its region of a given probability. Here it is the
    other way round: above the diagonal an estimator is too cautious, below it too confident.""",
    name="estimators",
    estimates=(read_estimate_files, "estimates/{source}/{estimate}/seed{seed}.csv"),
)
def draw_estimators(run: Run, estimates):
    """Registrations of all sources and seeds by the first method."""
    import pandas as pd

    method = next(iter(run.config["estimator_pairs"]["methods"]))
    titles = TITLES | run.titles(estimator_entry, run.config["estimators"])
    pooled = {}
    for name in titles:
        parts = [each for (_, by, _), each in estimates.items() if by == name]
        if not parts:
            raise InputError("estimates", f"are none of {name}", "regenerate them from a single config")
        rows = pd.concat(parts, ignore_index=True)
        pooled[name] = rows[(rows["method"] == method) & (rows["failure"] == "")]
    drawn = style.use_style().figure(figsize=(style.TEXT_WIDTH_IN, 3.6), layout="constrained")
    names = [name for name in titles if len(pooled[name])]
    informative = [SHOWN, *(name for name in names if name not in REFERENCES)][:8]
    left, right = drawn.subfigures(1, 2, width_ratios=(0.69, 0.31))
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
    from matplotlib.lines import Line2D

    handles = []
    for name in names:
        color, line = STYLES.get(name, OTHER)
        handles.append(Line2D([], [], color=color, linestyle=line, label=titles[name]))
    for label, marker, look in SIGNS:
        handles.append(Line2D([], [], **({"color": BLACK} | look), marker=marker, linestyle="", label=label))
    drawn.legend(handles=handles, loc="outside lower left", ncols=6, columnspacing=1.2)
    style.write_title(drawn, f"{', '.join(run.source_titles.values())}: {method_entry(method).title}")
    return drawn


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
