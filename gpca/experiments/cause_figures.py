"""Figures of single failures: with the eight counterfactuals and all scores, and as an observer re-enacts them."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.candidate import replay
from gpca.causes.dataset import LABELS, Causes
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import ALL, BY_SIZE, FAILED, SUBSETS
from gpca.declarations.result import Figure, Paths
from gpca.errors import InputError
from gpca.evaluation.measures import source_method_seed
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.perturbation import CONCEPTS, NOISE, OVERLAP
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reporting.figures import style
from gpca.reporting.figures.cloud_views import draw_clouds, legend_of_clouds, widest_views
from gpca.reporting.figures.panels import color_on_blue, write_below
from gpca.reporting.figures.style import SMALL_PT, TEXT_WIDTH_IN, blues, use_style, write_title
from gpca.reporting.words import object_in_words
from gpca.rigid import transform
from gpca.seeds import seed_of_file

PANEL_IN = 1.3
PANELS_IN = 3.0  # of the eight counterfactuals, two in each of four rows
HEAD_IN = 0.3
CAPTION_IN = 0.17
TRUTH = "measured share φ"
ROW_IN = 0.19
CLEAR = 0.6  # share of the largest φ in the sum of all from which a cause is clear
WORDS = {subset: " + ".join(CONCEPTS[i] for i in SUBSETS[subset]) or "none" for subset in BY_SIZE} | {ALL: "all three"}
GAP = 0.5  # of a row, between the measured shares and the scores, which are none


def draw_causes_example(
    objects_npz: str | Path,
    causes_npz: str | Path,
    predictions_csv: Paths,
    settings: CauseSettings,
    explainers: Mapping[str, str],
    title: str,
    dataset: str = "",
) -> Figure:
    """Draw the counterfactuals on the left, and on the right the measured shares and the scores of every explainer.

    Left is the observed cloud over the model after ICP with every subset of the causes, and the error v of each.
    The sample is a usual case with a clear cause, whoever is right about it: a failure of several causes whose largest
    φ is at least 0.6 of the sum of all. The paths name the shown source and seed.
    """
    causes = Causes.load(causes_npz)
    row = usual_failure(causes, causes_npz, is_clear(causes))
    source, seed = Path(causes_npz).parent.name, seed_of_file(causes_npz)
    model, observed_8 = replay(ObjectClouds.load(objects_npz), causes, row, source, seed, settings)
    names, scores_R_4, verdicts = _scores(causes, row, predictions_csv, explainers)
    rows_in = 0.35 + ROW_IN * (len(names) + GAP)
    height_in = HEAD_IN + max(4 * (0.75 * PANEL_IN + CAPTION_IN), rows_in)
    figure = use_style().figure(figsize=(TEXT_WIDTH_IN, height_in), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(PANELS_IN, TEXT_WIDTH_IN - PANELS_IN))
    view = widest_views(model)[0]
    clouds = {
        f"{words}: {100 * causes.truth.error[row, subset]:.1f} %": observed_8[subset] for subset, words in WORDS.items()
    }
    _draw_clouds(left.subplots(4, 2), model, clouds, view, size=0.9, cut=0.001)
    table, spare = right.subplots(2, 1, height_ratios=(rows_in, max(height_in - HEAD_IN - rows_in, 0.01)))
    spare.set_axis_off()
    _draw_scores(table, names, scores_R_4, verdicts)
    object_name = object_in_words(causes.registrations.object_name[row], dataset)
    shown_error = f"{100 * causes.error_shown[row]:.1f} %"
    write_title(figure, f"{title}: {object_name}. Errors relative to the diameter; registration shown: {shown_error}")
    legend_of_clouds(figure, "model", "observed", gap=0.2)
    return figure


def usual_failure(causes: Causes, path: str | Path, asked_S: np.ndarray) -> int:
    """Row of a failed test sample of several causes for which `asked_S` is true, if there is one for either.

    Of these it is the one whose margin, by which its largest φ exceeds the next one, is the median.
    """
    rows = np.flatnonzero((causes.registrations.split == "test") & (causes.truth.state == FAILED))
    if not len(rows):
        raise InputError(path, "has no failed test sample", "raise causes.test")
    for wanted_S in (causes.truth.causes.sum(axis=1) > 1, asked_S):
        rows = rows[wanted_S[rows]] if wanted_S[rows].any() else rows
    return int(rows[np.argsort(causes.truth.margin[rows], kind="stable")[len(rows) // 2]])


def is_clear(causes: Causes) -> np.ndarray:
    """Mask (S,) of samples of which one cause has a share of at least `CLEAR` in the failure."""
    phi_S_3 = np.maximum(causes.truth.phi, 0)
    return phi_S_3.max(axis=1) >= CLEAR * phi_S_3.sum(axis=1)


def _scores(causes: Causes, row: int, files: Paths, explainers: Mapping[str, str]):
    """Titles of the rows, their numbers (R, 4), and who is right: the measured shares first."""
    registrations, truth = causes.registrations, causes.truth
    phi = np.maximum(truth.phi[row], 0)
    tied = np.array(CONCEPTS)[truth.tied[row]]
    answers: dict[str, tuple[list[float], str]] = {}
    for path in files:
        _, name, _ = source_method_seed(path)
        rows = read_predictions(path)
        chosen = (rows["split"] == registrations.split[row]) & (rows["sample"] == str(registrations.sample[row]))
        prediction = rows[chosen].iloc[0]
        if not prediction["abstained"]:
            named = prediction["concept_predicted"]
            verdict = "right" if named == truth.dominant[row] else "tie" if named in tied else "wrong"
            answers[name] = [prediction[f"score_{label}"] for label in LABELS], verdict
    titles = [title for name, title in explainers.items() if name in answers]
    shown = [answers[name] for name in explainers if name in answers]
    scores_R_4 = np.array([[0.0, *(phi / max(phi.sum(), 1e-9))], *(scores for scores, _ in shown)], float)
    return [TRUTH, *titles], scores_R_4, ["", *(verdict for _, verdict in shown)]


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


PER_ROW = 4
CLOUD_IN, WORDS_IN, CAPTION_BELOW_IN, ERRORS_IN = 0.85, 0.17, 0.15, 2.1
CLOUDS = {"as observed": (NOISE, OVERLAP), "without noise": (OVERLAP,), "completed": (NOISE,), "both": ()}
LOOKS = ((style.BLUE, "o"), (style.VERMILION, "s"), (style.GREEN, "^"), (style.PURPLE, "D"))  # of the hypotheses
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

    The sample is a usual case in doubt: a failure of several causes that has more than one hypothesis. The paths name
    the shown source and seed.
    """
    from gpca.causes.descriptors import observed_pair
    from gpca.reenactment.dataset import Reenactments
    from gpca.reenactment.enactment import reenact

    source, seed = Path(causes_npz).parent.name, seed_of_file(causes_npz)
    causes = Causes.load(causes_npz, (source, seed))
    enacted = Reenactments.load(reenactments_npz, causes.registrations)
    row = usual_failure(causes, causes_npz, enacted.weight[:, 1] > 0)
    pair = observed_pair(causes, row, source, seed, "reenactment")
    again = reenact(pair, settings, truth)
    weight_K = enacted.weight[row][: len(again)]
    errors_K_8 = np.array([enactment.error_8 for enactment in again])
    if np.abs(errors_K_8 - enacted.error[row][: len(again)]).max() > AGREE:
        fault = f"has other errors of sample {enacted.sample[row]} than these settings give"
        raise InputError(reenactments_npz, fault, "regenerate it from a single config")

    rows_in = WORDS_IN + CLOUD_IN + CAPTION_BELOW_IN
    figure = use_style().figure(
        figsize=(style.COLUMN_WIDTH_IN, WORDS_IN + 2 * rows_in + ERRORS_IN), layout="constrained"
    )
    above, between, below = figure.subfigures(3, 1, height_ratios=(rows_in, rows_in, ERRORS_IN))
    view = widest_views(pair.model)[0]
    before = transform(pair.T_init, pair.observed)
    placed = {
        f"{k + 1}: {100 * weight:.0f} %": transform(enactment.hypothesis.T, before)
        for k, (enactment, weight) in enumerate(zip(again, weight_K, strict=True))
    }
    rebuilt = again[0].candidate
    clouds = {
        name: rebuilt.observed(tuple(cause for cause in present if rebuilt.applied[cause]))
        for name, present in CLOUDS.items()
    }
    for part, words, shown in (
        (above, "Hypotheses of the true pose, and how probable each is", placed),
        (between, "Clouds rebuilt under hypothesis 1", clouds),
    ):
        part.suptitle(words, x=0.005, ha="left", fontsize=SMALL_PT)
        _draw_clouds(part.subplots(1, PER_ROW), pair.model, shown, view, size=0.6, cut=0.005)
    _draw_errors(below.subplots(), causes.truth.error[row], errors_K_8, weight_K)
    below.suptitle("Mean error over the starts, with these causes", x=0.005, ha="left", fontsize=SMALL_PT)
    write_title(figure, f"{title}: {object_in_words(causes.registrations.object_name[row], dataset)}")
    legend_of_clouds(figure, "model", "observed", gap=0.2)
    return figure


def _draw_clouds(
    panels: np.ndarray, model: np.ndarray, clouds: Mapping[str, np.ndarray], view: np.ndarray, size: float, cut: float
) -> None:
    """Draw clouds over the model, each with its name below; all have one scale, and a share far off is cut."""
    seen = {name: cloud @ view.T for name, cloud in clouds.items()}
    corners = np.quantile(np.concatenate([model @ view.T, *seen.values()]), (cut, 1 - cut), axis=0)
    for panel, name in zip(panels.flat, [*seen, *[""] * (panels.size - len(seen))], strict=True):
        panel.set_axis_off()
        if name:
            draw_clouds(panel, model @ view.T, seen[name], size=size, corners=corners)
            write_below(panel, name, fontsize=SMALL_PT)


def _draw_errors(panel, true_8: np.ndarray, error_K_8: np.ndarray, weight_K: np.ndarray) -> None:
    """Draw the measured error of every subset as a bar, and a mark for each hypothesis, larger where it is probable."""
    from matplotlib.ticker import MaxNLocator

    subsets, place_8 = list(BY_SIZE), np.arange(len(BY_SIZE))
    panel.barh(place_8, 100 * true_8[subsets], height=0.7, color=style.LIGHT_GRAY, label="measured")
    spread = np.linspace(-0.2, 0.2, len(weight_K)) if len(weight_K) > 1 else [0.0]
    for k, (error_8, weight) in enumerate(zip(error_K_8, weight_K, strict=True)):
        color, marker = LOOKS[k % len(LOOKS)]
        area = LEAST_AREA + (MOST_AREA - LEAST_AREA) * weight
        look = {"s": area, "color": color, "marker": marker, "linewidths": 0, "zorder": 3}
        panel.scatter(100 * error_8[subsets], place_8 + spread[k], label=f"re-enacted, {k + 1}", **look)
    panel.set_yticks(place_8, list(WORDS.values()))
    panel.invert_yaxis()
    panel.set_xlim(left=0)
    panel.xaxis.set_major_locator(MaxNLocator("auto", prune="upper"))  # else the last number may reach over the edge
    panel.tick_params(axis="y", length=0)
    panel.set_xlabel("error (% of the diameter)")
    panel.legend(loc="best", handletextpad=0.3, borderaxespad=0.2)
