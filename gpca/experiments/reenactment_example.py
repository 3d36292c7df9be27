"""Drawing of one re-enactment: hypotheses of the true pose, rebuilt clouds, and errors beside the measured ones."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.rigid import transform
from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import ALL, BY_SIZE, FAILED, SUBSETS
from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS, NOISE, OVERLAP
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reporting.figures.cloud_views import draw_clouds, legend_of_clouds, widest_views
from gpca.reporting.figures.panels import write_below
from gpca.reporting.figures.style import (
    BLUE,
    COLUMN_WIDTH_IN,
    GREEN,
    LIGHT_GRAY,
    PURPLE,
    SMALL_PT,
    VERMILION,
    use_style,
    write_title,
)
from gpca.reporting.words import object_in_words
from gpca.seeds import seed_of_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gpca.reenactment.dataset import Reenactments
    from gpca.reenactment.enactment import Enactment

PER_ROW = 4
PANEL_IN, HEAD_IN, CAPTION_IN, ERRORS_IN = 0.85, 0.17, 0.15, 2.1
CLOUDS = {"as observed": (NOISE, OVERLAP), "without noise": (OVERLAP,), "completed": (NOISE,), "both": ()}
LOOKS = ((BLUE, "o"), (VERMILION, "s"), (GREEN, "^"), (PURPLE, "D"))  # of the hypotheses
LEAST_AREA, MOST_AREA = 6.0, 34.0  # points², of the marks of an improbable and of a certain hypothesis
AGREE = 1e-6  # diameters; numbers of a file and of the same re-enactment made again


def draw_reenactment(
    causes_npz: str | Path,
    reenactments_npz: str | Path,
    truth: CauseSettings,
    settings: ReenactmentSettings,
    title: str,
    dataset: str = "",
) -> Figure:
    """Draw above the observed cloud where each hypothesis puts it in the model, with its probability; below these the
    clouds that the first hypothesis rebuilds; and the errors of all eight registrations, measured and re-enacted.

    The sample is a usual case in doubt: of the failed test samples of several causes that have more than one
    hypothesis, it is the one whose margin, by which its largest φ exceeds the next one, is the median.

    Args:
        causes_npz, reenactments_npz: of the shown source and seed, which their paths name.
    """
    from gpca.causes.descriptors import observed_pair
    from gpca.reenactment.dataset import Reenactments
    from gpca.reenactment.enactment import reenact

    source, seed = Path(causes_npz).parent.name, seed_of_file(causes_npz)
    causes = Causes.load(causes_npz, (source, seed))
    enacted = Reenactments.load(reenactments_npz, causes.registrations)
    row = choose_sample(causes, enacted, causes_npz)
    pair = observed_pair(causes, row, source, seed, "reenactment")
    again = reenact(pair, settings, truth)
    weight_K = enacted.weight[row][: len(again)]
    _require_same(again, enacted, row, reenactments_npz)

    rows_in = HEAD_IN + PANEL_IN + CAPTION_IN
    figure = use_style().figure(figsize=(COLUMN_WIDTH_IN, HEAD_IN + 2 * rows_in + ERRORS_IN), layout="constrained")
    above, between, below = figure.subfigures(3, 1, height_ratios=(rows_in, rows_in, ERRORS_IN))
    view = widest_views(pair.model)[0]
    before = transform(pair.T_init, pair.observed)
    placed = {
        f"{k + 1}: {100 * weight:.0f} %": transform(enactment.hypothesis.T, before)
        for k, (enactment, weight) in enumerate(zip(again, weight_K, strict=True))
    }
    _draw_row(above, "Hypotheses of the true pose, and how probable each is", pair.model, placed, view)
    rebuilt = again[0].candidate
    clouds = {
        name: rebuilt.observed(tuple(cause for cause in present if rebuilt.applied[cause]))
        for name, present in CLOUDS.items()
    }
    _draw_row(between, "Clouds rebuilt under hypothesis 1", pair.model, clouds, view)
    _draw_errors(below.subplots(), causes.truth.error[row], [enactment.error_8 for enactment in again], weight_K)
    below.suptitle("Mean error over the starts, with these causes", x=0.005, ha="left", fontsize=SMALL_PT)
    write_title(figure, f"{title}: {object_in_words(causes.registrations.object_name[row], dataset)}")
    legend_of_clouds(figure, "model", "observed", gap=0.2)
    return figure


def choose_sample(causes: Causes, enacted: Reenactments, path: str | Path) -> int:
    """Row that is shown; see :func:`draw_reenactment`.

    Where no failed test sample has several causes or several hypotheses, that is not asked for.
    """
    rows = np.flatnonzero((causes.registrations.split == "test") & (causes.truth.state == FAILED))
    if not len(rows):
        raise InputError(path, "has no failed test sample", "raise causes.test")
    for asked_S in (causes.truth.causes.sum(axis=1) > 1, enacted.weight[:, 1] > 0):
        rows = rows[asked_S[rows]] if asked_S[rows].any() else rows
    return int(rows[np.argsort(causes.truth.margin[rows], kind="stable")[len(rows) // 2]])


def _require_same(again: list[Enactment], enacted: Reenactments, row: int, path: str | Path) -> None:
    """Raise an InputError unless the file has the numbers of the re-enactment that was made again."""
    errors_K_8 = np.array([enactment.error_8 for enactment in again])
    if np.abs(errors_K_8 - enacted.error[row][: len(again)]).max() > AGREE:
        fault = f"has other errors of sample {enacted.sample[row]} than these settings give"
        raise InputError(path, fault, "regenerate it from a single config")


def _draw_row(figure, words: str, model: np.ndarray, clouds: Mapping[str, np.ndarray], view: np.ndarray) -> None:
    """Draw clouds over the model, each with its name below; all have one scale, and what lies far off is cut."""
    figure.suptitle(words, x=0.005, ha="left", fontsize=SMALL_PT)
    seen = {name: cloud @ view.T for name, cloud in clouds.items()}
    everything = np.concatenate([model @ view.T, *seen.values()])
    corners = np.quantile(everything, (0.005, 0.995), axis=0)
    for panel, name in zip(figure.subplots(1, PER_ROW).flat, [*seen, *[""] * PER_ROW], strict=False):
        panel.set_axis_off()
        if name:
            draw_clouds(panel, model @ view.T, seen[name], size=0.6, corners=corners)
            write_below(panel, name, fontsize=SMALL_PT)


def _draw_errors(panel, true_8: np.ndarray, error_K_8: list[np.ndarray], weight_K: np.ndarray) -> None:
    """Draw the measured error of every subset as a bar, and a mark for each hypothesis, larger where it is probable."""
    from matplotlib.ticker import MaxNLocator

    subsets, place_8 = list(BY_SIZE), np.arange(len(BY_SIZE))
    panel.barh(place_8, 100 * true_8[subsets], height=0.7, color=LIGHT_GRAY, label="measured")
    spread = np.linspace(-0.2, 0.2, len(weight_K)) if len(weight_K) > 1 else [0.0]
    for k, (error_8, weight) in enumerate(zip(error_K_8, weight_K, strict=True)):
        color, marker = LOOKS[k % len(LOOKS)]
        area = LEAST_AREA + (MOST_AREA - LEAST_AREA) * weight
        look = {"s": area, "color": color, "marker": marker, "linewidths": 0, "zorder": 3}
        panel.scatter(100 * error_8[subsets], place_8 + spread[k], label=f"re-enacted, {k + 1}", **look)
    words = {subset: " + ".join(CONCEPTS[i] for i in SUBSETS[subset]) or "none" for subset in subsets}
    panel.set_yticks(place_8, list((words | {ALL: "all three"}).values()))
    panel.invert_yaxis()
    panel.set_xlim(left=0)
    panel.xaxis.set_major_locator(MaxNLocator("auto", prune="upper"))  # else the last number may reach over the edge
    panel.tick_params(axis="y", length=0)
    panel.set_xlabel("error (% of the diameter)")
    panel.legend(loc="best", handletextpad=0.3, borderaxespad=0.2)
