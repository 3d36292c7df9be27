"""Draws one failed registration with its eight counterfactuals, and the explainers' scores beside the truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.candidate import replay
from gpca.causes.dataset import LABELS, Causes
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import ALL, BY_SIZE, FAILED, SUBSETS
from gpca.errors import InputError
from gpca.evaluation.measures import source_method_seed
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.cloud_views import draw_clouds, legend_of_clouds, widest_views
from gpca.reporting.figures.panels import color_on_blue, write_below
from gpca.reporting.figures.style import SMALL_PT, TEXT_WIDTH_IN, blues, use_style, write_title
from gpca.reporting.words import object_in_words
from gpca.seeds import seed_of_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PANEL_IN = 1.3
PANELS_IN = 3.0  # of the eight counterfactuals, two in each of four rows
HEAD_IN = 0.3
CAPTION_IN = 0.17
TRUTH = "measured share φ"
ROW_IN = 0.19
CLEAR = 0.6  # share of the largest φ in the sum of all from which a cause is clear
GAP = 0.5  # of a row, between the measured shares and the scores, which are none


def draw_causes_example(
    objects_npz: str | Path,
    causes_npz: str | Path,
    predictions_csv: Sequence[str | Path],
    settings: Mapping,
    explainers: Mapping[str, str],
    title: str,
    dataset: str = "",
) -> Figure:
    """Draw the counterfactuals on the left, and on the right the measured shares and the scores of every explainer.

    Left is the observed cloud over the model after ICP with every subset of the causes, and the error v of each.
    The sample is a usual case with a clear cause, whoever is right about it. Of the failed test samples of several
    causes whose largest φ is at least 0.6 of the sum of all, it is the one whose margin, by which its largest φ exceeds
    the next one, is the median. Where none is so clear, all that have several causes count, or else all that failed.

    Args:
        objects_npz, causes_npz: Of the shown source and seed, which their paths name.
        predictions_csv: One file per explainer, of the same source and seed.
        settings: The config's section ``causes`` with ``icp``.
    """
    causes = Causes.load(causes_npz)
    row = choose_sample(causes, causes_npz)
    source, seed = Path(causes_npz).parent.name, seed_of_file(causes_npz)
    sections = dict(settings)
    own = CauseSettings.from_dict({k: v for k, v in sections.items() if k != "icp"}, sections.get("icp"))
    model, observed_8 = replay(ObjectClouds.load(objects_npz), causes, row, source, seed, own)
    names, scores_R_4, verdicts = _scores(causes, row, predictions_csv, explainers)
    rows_in = 0.35 + ROW_IN * (len(names) + GAP)
    height_in = HEAD_IN + max(4 * (0.75 * PANEL_IN + CAPTION_IN), rows_in)
    figure = use_style().figure(figsize=(TEXT_WIDTH_IN, height_in), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(PANELS_IN, TEXT_WIDTH_IN - PANELS_IN))
    view = widest_views(model)[0]
    everything = np.concatenate([model @ view.T, *(cloud @ view.T for cloud in observed_8)])
    corners = np.quantile(everything, (0.001, 0.999), axis=0)
    for panel, subset in zip(left.subplots(4, 2).flat, BY_SIZE, strict=True):
        draw_clouds(panel, model @ view.T, observed_8[subset] @ view.T, size=0.9, corners=corners)
        words = " + ".join(CONCEPTS[i] for i in SUBSETS[subset]) or "none"
        words = "all three" if subset == ALL else words
        write_below(panel, f"{words}: {100 * causes.truth.error[row, subset]:.1f} %", fontsize=SMALL_PT)
    table, spare = right.subplots(2, 1, height_ratios=(rows_in, max(height_in - HEAD_IN - rows_in, 0.01)))
    spare.set_axis_off()
    _draw_scores(table, names, scores_R_4, verdicts)
    object_name = object_in_words(causes.registrations.object_name[row], dataset)
    shown_error = f"{100 * causes.error_shown[row]:.1f} %"
    write_title(figure, f"{title}: {object_name}. Errors relative to the diameter; registration shown: {shown_error}")
    legend_of_clouds(figure, "model", "observed", gap=0.2)
    return figure


def choose_sample(causes: Causes, path: str | Path) -> int:
    """Return the row that is shown; see :func:`draw_causes_example`."""
    failed = np.flatnonzero((causes.registrations.split == "test") & (causes.truth.state == FAILED))
    if not len(failed):
        raise InputError(path, "has no failed test sample", "raise causes.test")
    phi_F_3 = np.maximum(causes.truth.phi[failed], 0)
    of_several = causes.truth.causes[failed].sum(axis=1) > 1
    clear = of_several & (phi_F_3.max(axis=1) >= CLEAR * phi_F_3.sum(axis=1))
    rows = next(failed[chosen] for chosen in (clear, of_several, failed >= 0) if chosen.any())
    return int(rows[np.argsort(causes.truth.margin[rows], kind="stable")[len(rows) // 2]])


def _scores(causes: Causes, row: int, files: Sequence[str | Path], explainers: Mapping[str, str]):
    """Return the titles of the rows, their numbers (R, 4), and who is right: the measured shares first."""
    registrations, truth = causes.registrations, causes.truth
    phi = np.maximum(truth.phi[row], 0)
    tied = np.array(CONCEPTS)[truth.tied[row]]
    by_name, verdict_of = {}, {}
    for path in [files] if isinstance(files, str) else files:
        _, name, _ = source_method_seed(path)
        rows = read_predictions(path)
        of_sample = (rows["split"] == registrations.split[row]) & (rows["sample"] == str(registrations.sample[row]))
        if of_sample.sum() != 1:
            raise InputError(path, "lacks the sample that is shown", "regenerate it from the same config")
        prediction = rows[of_sample].iloc[0]
        if not prediction["abstained"]:
            by_name[name] = [prediction[f"score_{label}"] for label in LABELS]
            named = prediction["concept_predicted"]
            right = "right" if named == truth.dominant[row] else "tie" if named in tied else "wrong"
            verdict_of[name] = right
    named = [name for name in explainers if name in by_name]
    shares = [0.0, *(phi / max(phi.sum(), 1e-9))]
    scores_R_4 = np.array([shares, *(by_name[name] for name in named)], float)
    return [TRUTH, *(explainers[name] for name in named)], scores_R_4, ["", *(verdict_of[name] for name in named)]


def _draw_scores(panel, names: list[str], scores_R_4: np.ndarray, verdicts: Sequence[str]) -> None:
    """Draw the measured shares, and with a gap below them the scores; the largest of each row is bold.

    Beside each row stands whether what it names is the dominant cause, or ties with it.
    """
    place_R = np.arange(len(names)) + GAP * (np.arange(len(names)) > 0)
    sides = -0.5, len(LABELS) - 0.5
    for rows in (slice(0, 1), slice(1, None)):
        if len(place_R[rows]):
            extent = (*sides, place_R[rows][-1] + 0.5, place_R[rows][0] - 0.5)
            panel.imshow(scores_R_4[rows], cmap=blues(), vmin=0, vmax=1, aspect="auto", extent=extent)
    for place, verdict in zip(place_R, verdicts, strict=True):
        look = {"fontsize": SMALL_PT, "weight": "normal" if verdict == "wrong" else "bold"}
        panel.text(len(LABELS), place, verdict, ha="center", va="center_baseline", **look)
    panel.set(xlim=(sides[0], sides[1] + 1), ylim=(place_R[-1] + 0.5, -0.5))
    for (row, column), score in np.ndenumerate(scores_R_4):
        look = {"fontsize": SMALL_PT, "color": color_on_blue(score)}
        look["weight"] = "bold" if score == scores_R_4[row].max() else "normal"
        panel.text(column, place_R[row], f"{score:.2f}", ha="center", va="center_baseline", **look)
    panel.spines[:].set_visible(False)
    panel.set_yticks(place_R, names, fontsize=SMALL_PT)
    panel.set_xticks(range(len(LABELS) + 1), [*LABELS, "answer"], fontsize=SMALL_PT)
    panel.tick_params(length=0, pad=2, labeltop=True, labelbottom=False)
