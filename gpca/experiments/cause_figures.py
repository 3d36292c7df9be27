"""Figures of single failures: with the eight counterfactuals and all scores, and as an observer re-enacts them."""

from collections.abc import Mapping
from pathlib import Path
from textwrap import fill

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.candidate import replay
from gpca.causes.dataset import LABELS, Causes
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import ALL, BY_SIZE, FAILED, NONE, SUBSETS, shapley_values
from gpca.declarations import Figure, Paths, Run, figure
from gpca.errors import InputError
from gpca.evaluation.measures import source_method_seed
from gpca.experiments.cause_tables import COMPARED, SECTION
from gpca.experiments.diagnosis import cause_titles
from gpca.experiments.registration_stages import title_of_sample
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.perturbation import CONCEPTS, NOISE, OVERLAP
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reporting.figures import style
from gpca.reporting.figures.cloud_views import widest_views
from gpca.reporting.figures.panels import color_on_blue, write_below
from gpca.reporting.figures.solid import NEUTRAL, Solid
from gpca.reporting.figures.style import CONCEPT_COLORS, SMALL_PT, TEXT_WIDTH_IN, blues, use_style, write_title
from gpca.rigid import transform
from gpca.seeds import seed_of_file
from gpca.settings import read_settings

HEAD_IN, SOLID_IN = 0.3, 2.1
PIXELS = 640  # of a solid, on each side
CUT, MARGIN = 0.01, 0.03  # share of observed points that lie outside, and diameters around all others
TRUTH = "measured share φ"
ROW_IN = 0.19
CLEAR = 0.6  # share of the largest φ in the sum of all from which a cause is clear
WORDS = {subset: " + ".join(CONCEPTS[i] for i in SUBSETS[subset]) or "none" for subset in BY_SIZE} | {ALL: "all three"}
GAP = 0.5  # of a row, between the measured shares and the scores, which are none


@figure(
    SECTION,
    "One failed registration and its counterfactuals",
    """A failed registration, registered again with every subset of its causes: Shapley's value φ of a cause is what it
    added to the error. Below are the scores of some explainers, which saw all causes at once, and who names the
    dominant cause (right), one that adds nearly as much (tie) or another (wrong). Shown is the median failure by
    margin among those with a clear cause, at least 0.6 of the sum.""",
    objects_npz="objects/{shown_source}.npz",
    causes_npz="causes/{shown_source}/seed{first_seed}.npz",
    predictions_csv="diagnoses/{shown_source}/{cause_explainer}/seed{first_seed}.csv",
)
def causes_example(run: Run, objects_npz: Path, causes_npz: Path, predictions_csv: Paths) -> Figure:
    titles = cause_titles(run.config)
    explainers = {name: titles[name] for name in (*COMPARED, "rule") if name in titles} or titles
    causes, objects = Causes.load(causes_npz), ObjectClouds.load(objects_npz)
    row = usual_failure(causes, causes_npz, is_clear(causes))
    source, seed = run.config["figures"]["source"], seed_of_file(causes_npz)
    _, observed_8 = replay(objects, causes, row, source, seed, _truth_of(run))
    error_8, phi_3 = causes.truth.error[row], causes.truth.phi[row]
    shares_3 = np.maximum(phi_3, 0) / max(np.maximum(phi_3, 0).sum(), 1e-9)
    answers = {TRUTH: (np.array([0.0, *shares_3]), "")} | _answers(causes, row, predictions_csv, explainers)
    below_in = 0.35 + ROW_IN * max(len(answers) + GAP, 5)
    drawing = use_style().figure(figsize=(TEXT_WIDTH_IN, HEAD_IN + SOLID_IN + below_in), layout="constrained")
    above, below = drawing.subfigures(2, 1, height_ratios=(SOLID_IN + HEAD_IN / 2, below_in + HEAD_IN / 2))
    most = int(np.argmax(phi_3))
    stages = {"with all three causes": ALL, f"without {CONCEPTS[most]}": ALL - 2**most, "without any": NONE}
    clouds = {f"{words}: {100 * error_8[subset]:.1f} %": observed_8[subset] for words, subset in stages.items()}
    _draw_over_solid(above.subplots(1, len(clouds)), objects, causes, row, clouds, size=2.5)
    left, right = below.subfigures(1, 2, width_ratios=(0.42, 0.58))
    _draw_waterfall(left.subplots(), error_8[NONE], phi_3)
    _draw_scores(right.subplots(), answers)
    error = f"{100 * causes.error_shown[row]:.1f} %"
    sample = title_of_sample(run, causes.registrations.object_name[row])
    write_title(drawing, f"{sample}. The registration shown to the explainers is off by {error}")
    return drawing


def _truth_of(run: Run) -> CauseSettings:
    return CauseSettings.from_dict(dict(run.config["causes"]), dict(run.config["registrations"]["icp"]))


GALLERY_IN, LETTERS = 1.8, 44  # height of a row of failures with what explainers say, and letters of a line there
IN_BRIEF = {"reenact": "re-enactment", "gpca": "GP-CA", "rule": "rule"}  # explainers of the gallery


@figure(
    SECTION,
    "Failures, and what explainers name",
    """A failed test registration of each dataset and each dominant cause, the one of median error, as ICP left it.
    Below stands who names the dominant cause, who one that adds nearly as much (tie), and who another.""",
    objects_files="objects/{source}.npz",
    causes_files="causes/{source}/seed{first_seed}.npz",
    predictions_csv="diagnoses/{source}/{cause_explainer}/seed{first_seed}.csv",
)
def failures(run: Run, objects_files: Paths, causes_files: Paths, predictions_csv: Paths) -> Figure:
    titles = cause_titles(run.config)
    explainers = {name: words for name, words in IN_BRIEF.items() if name in titles} or dict(list(titles.items())[:3])
    size = (TEXT_WIDTH_IN, HEAD_IN + GALLERY_IN * len(run.sources))
    drawing = use_style().figure(figsize=size, layout="constrained")
    parts = drawing.subfigures(len(run.sources), 1, squeeze=False)[:, 0]
    for part, source, *files in zip(parts, run.sources, objects_files, causes_files, strict=True):
        part.supylabel(fill(run.source_titles[source], LETTERS // 2))
        objects, causes = ObjectClouds.load(files[0]), Causes.load(files[1])
        predictions = [path for path in predictions_csv if Path(path).parents[1].name == source]
        failed_S = (causes.registrations.split == "test") & (causes.truth.state == FAILED)
        for concept, panel in zip(CONCEPTS, part.subplots(1, len(CONCEPTS)), strict=True):
            rows = np.flatnonzero(failed_S & (causes.truth.dominant == concept))
            panel.set_axis_off()
            if not len(rows):
                write_below(panel, f"no failure by {concept}", fontsize=SMALL_PT)
                continue
            row = _median(rows, causes.error_shown)
            named_by: dict[str, list[str]] = {"right": [], "tie": [], "wrong": []}
            for name, (scores_4, verdict) in _answers(causes, row, predictions, explainers).items():
                named_by[verdict].append(name if verdict == "right" else f"{name} ({LABELS[scores_4.argmax()]})")
            words = [f"{concept}: {100 * causes.error_shown[row]:.0f} % off"]
            words += [fill(f"{verdict}: {', '.join(names)}", LETTERS) for verdict, names in named_by.items() if names]
            clouds = {"\n".join(words): causes.registrations.cloud(row)}
            _draw_over_solid(np.array([panel]), objects, causes, row, clouds, size=2.0)
    write_title(drawing, "Failed registrations, and what explainers name")
    return drawing


def _draw_over_solid(
    panels: np.ndarray, objects: ObjectClouds, causes: Causes, row: int, clouds: Mapping[str, np.ndarray], size: float
) -> None:
    """Draw the model of a sample as a shaded solid and clouds over it, each with its name below, at one scale."""
    index = objects.row(causes.registrations.object_name[row])
    points, normals = (of(index).astype(float) for of in (objects.points, objects.normals_of))
    points = points / objects.diameters_m[index]
    axes = widest_views(points)[0]
    solid = Solid.of(points, normals, axes, PIXELS, NEUTRAL)
    seen = np.concatenate([cloud @ axes[:2].T for cloud in clouds.values()])
    outer = np.concatenate([points @ axes[:2].T, np.quantile(seen, (CUT, 1 - CUT), axis=0)])
    corners_2_2 = np.stack([outer.min(axis=0), outer.max(axis=0)], axis=1) + MARGIN * np.array([-1, 1])
    for panel, (name, cloud) in zip(panels.flat, clouds.items(), strict=False):
        solid.draw(panel, cloud, size, corners_2_2)
        write_below(panel, name, fontsize=SMALL_PT)


def _draw_waterfall(panel, error: float, phi_3: np.ndarray) -> None:
    """Draw an error without causes and what each cause adds to it, its Shapley value: bars that end at the sum."""
    order = np.argsort(phi_3, kind="stable")
    names = [CONCEPTS[cause] for cause in order]
    ends = 100 * np.cumsum([error, *phi_3[order]])
    start, width = [0.0, *ends[:-1], 0.0], [*np.diff(ends, prepend=0.0), ends[-1]]
    colors = [style.LIGHT_GRAY, *(CONCEPT_COLORS[name] for name in names), style.LIGHT_GRAY]
    panel.barh(range(len(width)), width, left=start, color=colors, height=0.7)
    for place, (left, wide) in enumerate(zip(start, width, strict=True)):
        sign = "+" if 0 < place < len(width) - 1 and wide >= 0 else ""
        panel.text(max(left, left + wide), place, f" {sign}{wide:.1f}", va="center_baseline", fontsize=SMALL_PT)
    panel.set_yticks(range(len(width)), ["without causes", *names, "all three"], fontsize=SMALL_PT)
    panel.invert_yaxis()
    panel.set_xlim(min(0.0, *start), 1.18 * max(ends))
    panel.set_xlabel("mean error over the starts (% of the diameter)", fontsize=SMALL_PT)
    panel.tick_params(axis="y", length=0)


def usual_failure(causes: Causes, path: str | Path, asked_S: np.ndarray) -> int:
    """Row of a failed test sample of several causes for which `asked_S` is true, if there is one for either.

    Of these it is the one whose margin, by which its largest φ exceeds the next one, is the median.
    """
    rows = np.flatnonzero((causes.registrations.split == "test") & (causes.truth.state == FAILED))
    if not len(rows):
        raise InputError(path, "has no failed test sample", "raise causes.test")
    for wanted_S in (causes.truth.causes.sum(axis=1) > 1, asked_S):
        rows = rows[wanted_S[rows]] if wanted_S[rows].any() else rows
    return _median(rows, causes.truth.margin)


def _median(rows: np.ndarray, value_S: np.ndarray) -> int:
    return int(rows[np.argsort(value_S[rows], kind="stable")[len(rows) // 2]])


def is_clear(causes: Causes) -> np.ndarray:
    """Mask (S,) of samples of which one cause has a share of at least `CLEAR` in the failure."""
    phi_S_3 = np.maximum(causes.truth.phi, 0)
    return phi_S_3.max(axis=1) >= CLEAR * phi_S_3.sum(axis=1)


Answers = dict[str, tuple[np.ndarray, str]]  # title -> scores (4,) of the labels, and whether what it names is right


def _answers(causes: Causes, row: int, files: Paths, explainers: Mapping[str, str]) -> Answers:
    registrations, truth = causes.registrations, causes.truth
    right = {concept: "tie" for concept, tied in zip(CONCEPTS, truth.tied[row], strict=True) if tied}
    right[truth.dominant[row]] = "right"
    file_of = {source_method_seed(path)[1]: path for path in files}
    answers = {}
    for name, title in explainers.items():
        rows = read_predictions(file_of[name])
        chosen = (rows["split"] == registrations.split[row]) & (rows["sample"] == str(registrations.sample[row]))
        prediction = rows[chosen].iloc[0]
        if not prediction["abstained"]:
            scores_4 = prediction[[f"score_{label}" for label in LABELS]].to_numpy(float)
            words = title if list(explainers.values()).count(title) == 1 else f"{title} ({name})"
            answers[words] = scores_4, right.get(prediction["concept_predicted"], "wrong")
    return answers


def _draw_scores(panel, answers: Answers) -> None:
    """Draw the measured shares, which come first, and with a gap below them the scores; the largest of each is bold."""
    place_R = np.arange(len(answers)) + GAP * (np.arange(len(answers)) > 0)
    left, right = -0.5, len(LABELS) - 0.5
    for place, (scores_4, verdict) in zip(place_R, answers.values(), strict=True):
        extent = (left, right, place + 0.5, place - 0.5)
        panel.imshow(scores_4[None], cmap=blues(), vmin=0, vmax=1, aspect="auto", extent=extent)
        cells = [(f"{score:.2f}", score == scores_4.max(), color_on_blue(score)) for score in scores_4]
        for column, (words, is_bold, color) in enumerate([*cells, (verdict, verdict != "wrong", style.BLACK)]):
            look = {"fontsize": SMALL_PT, "color": color, "weight": "bold" if is_bold else "normal"}
            panel.text(column, place, words, ha="center", va="center_baseline", **look)
    panel.set(xlim=(left, right + 1), ylim=(place_R[-1] + 0.5, -0.5))
    panel.spines[:].set_visible(False)
    panel.set_yticks(place_R, answers, fontsize=SMALL_PT)
    panel.set_xticks(range(len(LABELS) + 1), [*LABELS, "answer"], fontsize=SMALL_PT)
    panel.tick_params(length=0, pad=2, labeltop=True, labelbottom=False)


SOLIDS_IN, CAPTION_IN, ERRORS_IN = 1.15, 0.36, 1.55
LOOKS = ((style.BLUE, "o"), (style.VERMILION, "s"), (style.GREEN, "^"), (style.PURPLE, "D"))  # of the hypotheses
LEAST_AREA, MOST_AREA = 6.0, 34.0  # points², of the marks of an improbable and of a certain hypothesis
AGREE = 1e-6  # diameters; numbers of a file and of the same re-enactment made again


@figure(
    SECTION,
    "One failed registration, re-enacted by an observer",
    """Above, what ICP made of the observed cloud, where the likeliest hypothesis of the true pose puts it in the model,
    with its probability, and the clouds that are rebuilt there. Below, the mean error of registrations with each
    subset of the causes: measured, with the truth (bars), and re-enacted under each hypothesis (marks, the larger the
    more probable). Shown is the failed test sample of median margin with several causes and several hypotheses.""",
    objects_npz="objects/{shown_source}.npz",
    causes_npz="causes/{shown_source}/seed{first_seed}.npz",
    reenactments_npz="reenactments/{shown_source}/seed{first_seed}.npz",
)
def reenactment(run: Run, objects_npz: Path, causes_npz: Path, reenactments_npz: Path) -> Figure:
    from gpca.causes.descriptors import observed_pair
    from gpca.reenactment.dataset import Reenactments
    from gpca.reenactment.enactment import reenact

    settings = read_settings(ReenactmentSettings, dict(run.config["diagnosis"]["reenactment"]))
    source, seed = run.config["figures"]["source"], seed_of_file(causes_npz)
    causes = Causes.load(causes_npz, (source, seed))
    enacted = Reenactments.load(reenactments_npz, causes.registrations)
    row = usual_failure(causes, causes_npz, enacted.weight[:, 1] > 0)
    pair = observed_pair(causes, row, source, seed, "reenactment")
    again = reenact(pair, settings, _truth_of(run))
    weight_K = enacted.weight[row][: len(again)]
    errors_K_8 = np.array([enactment.error_8 for enactment in again])
    if np.abs(errors_K_8 - enacted.error[row][: len(again)]).max() > AGREE:
        fault = f"has other errors of sample {enacted.sample[row]} than these settings give"
        raise InputError(reenactments_npz, fault, "regenerate it from a single config")

    first, rebuilt = again[0].hypothesis, again[0].candidate
    applied = rebuilt.present
    clouds = {
        "after ICP": pair.observed,
        f"likeliest pose: {100 * weight_K[0]:.0f} %": transform(first.T, transform(pair.T_init, pair.observed)),
        "there, without noise": rebuilt.observed(tuple(cause for cause in applied if cause != NOISE)),
        "there, completed": rebuilt.observed(tuple(cause for cause in applied if cause != OVERLAP)),
    }
    strip_in = HEAD_IN + SOLIDS_IN + CAPTION_IN
    drawing = use_style().figure(figsize=(TEXT_WIDTH_IN, strip_in + ERRORS_IN), layout="constrained")
    above, below = drawing.subfigures(2, 1, height_ratios=(strip_in, ERRORS_IN))
    _draw_over_solid(above.subplots(1, len(clouds)), ObjectClouds.load(objects_npz), causes, row, clouds, size=1.5)
    _draw_errors(below.subplots(), causes.truth.error[row], errors_K_8, weight_K)
    phi_3 = shapley_values((weight_K @ errors_K_8)[None])[0]
    named, true = CONCEPTS[int(np.argmax(phi_3))], causes.truth.dominant[row]
    verdict = f"It names {named}" + (", as measured" if named == true else f"; measured is {true}")
    write_title(drawing, f"{title_of_sample(run, causes.registrations.object_name[row])}. {verdict}")
    return drawing


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
    panel.set_xlabel("mean error over the starts with these causes (% of the diameter)")
    panel.legend(loc="best", handletextpad=0.3, borderaxespad=0.2)
