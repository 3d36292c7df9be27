"""The method in figures: overview, concepts and objects (Figures 2 and 3); the pipeline stands apart (Figure 4)."""

from pathlib import Path
from typing import Any

import numpy as np

from gpca.causes.policy import NOTHING, QUEUE, Decision, RecoveryPolicy
from gpca.declarations import Experiment, Figure, Run, figure
from gpca.errors import InputError
from gpca.evaluation.intervals import mean_ranks
from gpca.experiments import registration_stages as stages_of
from gpca.experiments.frames import encoder_title
from gpca.experiments.recovery_example import short_action
from gpca.experiments.registration_stages import FILES, Staged, title_of_sample
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS, SEVERITIES_OF
from gpca.reporting.figures import style
from gpca.reporting.figures.cloud_views import draw_clouds, legend_of_clouds, widest_views
from gpca.reporting.figures.diagram import Canvas
from gpca.reporting.figures.panels import panels, write_below
from gpca.reporting.figures.style import BLUE, CONCEPT_COLORS, GRAY, write_title

EXPERIMENT = Experiment(name="method", beside=("pipeline",))
SECTION = "IV-A Datasets and controlled perturbations"
CONCEPT = "pose"  # of the sample that Fig. 2 shows, because before and after ICP differ to the eye
CONCEPT_TITLES = {"noise": "Noise", "pose": "Pose error", "overlap": "Overlap"}
NO_ACTION = "No action:\n$u$ is that of\na clean pair"
THRESHOLD: dict[str, Any] = {"color": style.BLACK, "linestyle": (0, (3, 2)), "linewidth": 0.8}  # the look of its line


@figure(
    "III Gaussian process concept attribution",
    "Figure 2: overview",
    """After Figure 2 of the paper: ICP refines the pose, the encoder turns the aligned cloud into an embedding, the
    Gaussian process classifier gives every concept a score and a variance. Nothing is done where the uncertainty u is
    that of a clean pair, below which 95 % of them lie; a person is asked where BALD is above its threshold or no score
    reaches theirs (dashed); else the dominant concept is acted on. The sample shown has the median score among the
    uncertain and failed test samples with a pose error that are named correctly.""",
    paper=True,
    **FILES,
)
def fig2_overview(run: Run, registrations: Path, embeddings: Path, predictions: Path, uncertainties: Path) -> Figure:
    treatments = dict(run.config["recovery"]["treatments"])
    stages = Staged.load(registrations, embeddings, predictions, uncertainties, run.config["causes"]["limits"])
    row = stages.choose(CONCEPT, registrations)
    sample = stages.predictions.iloc[row]
    if (named := sample["concept_predicted"]) not in treatments:
        raise InputError("recovery.treatments", f"has no action for '{named}'", "name one in the config")
    canvas = Canvas(style.COLUMN_WIDTH_IN, 2.95)

    seen = stages.seen(row)
    corners = np.concatenate([np.concatenate(pair) for pair in seen.values()])
    for left_in, caption, (which, pair) in zip((0.02, 1.42), ("initial", "aligned"), seen.items(), strict=True):
        draw_clouds(canvas.panel(left_in, 1.78, 1.08, 0.92), *pair, 1.0, (corners.min(axis=0), corners.max(axis=0)))
        canvas.text(left_in + 0.54, 1.74, f"{caption}: {stages.words(row, which)}", va="top")
    canvas.arrow((1.12, 2.24), (1.40, 2.24), words="ICP")
    canvas.arrow((2.52, 2.24), (2.96, 2.24), words=encoder_title(**run.config["embedding"]))
    stages_of.draw_embedding(canvas.panel(3.02, 1.86, 0.42, 0.76), stages.h_S_d[row])
    canvas.text(3.23, 1.74, rf"$\mathbf{{h}} \in \mathbb{{R}}^{{{stages.h_S_d.shape[1]}}}$", va="top")

    canvas.box(2.22, 1.14, 1.26, 0.25, "GP classifier", BLUE)
    canvas.arrow((3.23, 1.56), (3.23, 1.39))
    canvas.arrow((2.79, 1.14), (2.79, 0.97))
    scores = canvas.panel(2.58, 0.36, 0.42, 0.56)
    stages_of.draw_scores(scores, sample, numbered=True)
    canvas.text(2.79, 0.02, r"scores $\hat{s}_c \pm \sqrt{v_c}$", va="bottom")

    bald_N = stages.predictions.loc[stages.predictions["split"] == "test", "bald"].to_numpy()
    policy = RecoveryPolicy.of_settings(dict(run.config["recovery"]["thresholds"]), treatments, 1, bald_N)
    limit, action = policy.thresholds.uncertain, decide(stages, row, policy).action
    scores.axvline(policy.thresholds.dominant, **THRESHOLD)
    axes = canvas.panel(1.26, 0.36, 0.72, 0.48)
    axes.hist(bald_N, bins=12, color=style.LIGHT_GRAY)
    axes.axvline(float(sample["bald"]), color=BLUE, linewidth=1.2)
    axes.axvline(limit, **THRESHOLD)
    axes.set(yticks=[], xlim=(0, None))
    axes.spines["left"].set_visible(False)
    axes.tick_params(pad=1.5, length=2)
    axes.locator_params(axis="x", nbins=3)
    axes.margins(y=0)
    canvas.text(1.58, 0.02, f"BALD: ask above {limit:.2f} nats", va="bottom")
    canvas.arrow((2.2, 0.6), (2.02, 0.6))
    acts, asks = action not in (NOTHING, QUEUE), action == QUEUE
    canvas.arrow((1.22, 0.6), (0.96, 0.6), words="low", color=GRAY if asks else BLUE)
    follows = f"Act on {named}:\n{short_action(treatments[named])}" if action != NOTHING else NO_ACTION
    canvas.box(0.02, 0.32, 0.92, 0.56, follows, CONCEPT_COLORS[named] if acts else GRAY, dashed=asks)
    canvas.arrow((1.62, 0.88), (1.62, 1.08), color=BLUE if asks else GRAY)
    canvas.text(1.66, 0.97, "high", ha="left", va="center")
    question, color = "Ask a person for the concept\nof a few such cases", BLUE if asks else GRAY
    canvas.box(0.02, 1.08, 1.9, 0.37, question, color, dashed=not asks)
    canvas.arrow((1.92, 1.265), (2.22, 1.265), words="retrain")

    write_title(canvas.figure, title_of_sample(run, sample["object"]))
    for x_in, color, words in ((0.06, style.TARGET_COLOR, "target"), (0.5, style.SOURCE_COLOR, "source")):
        canvas.dot(x_in, 2.74, color, words)
    return canvas.figure


def decide(stages: Staged, row: int, policy: RecoveryPolicy) -> Decision:
    """Decision on a row from what GP-CA knows: nothing where u is that of a clean pair, else the policy's."""
    if stages.u_S[row] <= stages.u_clean:
        return Decision(NOTHING, "", f"u {stages.u_S[row]:.1f} is that of a clean pair")
    sample = stages.predictions.iloc[row]
    return policy.decide(np.array([float(sample[f"score_{name}"]) for name in CONCEPTS]), float(sample["bald"]))


@figure(
    SECTION,
    "Figure 3: the three concepts",
    """After Figure 3 of the paper: one object's clean target (orange) and its perturbed source before ICP (blue), for
    noise, pose error and partial overlap. Every sample has one such perturbation, and its name is the label that
    explainers have to find. The object shown is the one whose test samples come nearest to medium severities.""",
    paper=True,
    objects_file="objects/{shown_source}.npz",
    registrations_file=FILES["registrations"],
)
def fig3_concepts(run: Run, objects_file: Path, registrations_file: Path) -> Figure:
    objects, registrations = ObjectClouds.load(objects_file), Registrations.load(registrations_file)
    samples = choose_samples(registrations, registrations_file)
    name = str(registrations.object_name[samples["noise"]])
    sources = {concept: stages_of.source_before_icp(registrations, sample) for concept, sample in samples.items()}
    row = objects.row(name)
    points_shown = max(len(source) for source in sources.values())  # so that both clouds are equally dense
    target = objects.points(row)[:points_shown] / objects.diameters_m[row]
    # Of the directions that show the object widest, that in which pose error and cut shift the centroid most.
    shifts = [sources[concept].mean(axis=0) - target.mean(axis=0) for concept in ("pose", "overlap")]
    view = max(widest_views(target), key=lambda view: np.prod([np.linalg.norm(view[:2] @ shift) for shift in shifts]))

    clouds = {concept: (target @ view.T, source @ view.T) for concept, source in sources.items()}
    corners = np.concatenate([np.concatenate(pair) for pair in clouds.values()])
    low, high = corners.min(axis=0), corners.max(axis=0)
    height_in = style.TEXT_WIDTH_IN / len(clouds) * (high[1] - low[1]) / (high[0] - low[0]) + 0.45  # title and captions
    drawing, [drawn] = panels(1, len(clouds), height_in)
    for letter, panel, (concept, (target_view, source_view)) in zip("abc", drawn, clouds.items(), strict=True):
        draw_clouds(panel, target_view, source_view, corners=(low, high))
        severity = stages_of.severity_text(registrations, samples[concept], concept)
        write_below(panel, f"({letter}) {CONCEPT_TITLES[concept]}: {severity}")
    legend_of_clouds(drawing, "target", "perturbed source, before ICP", gap=0.2)
    write_title(drawing, title_of_sample(run, name))
    return drawing


def choose_samples(registrations: Registrations, path: str | Path) -> dict[str, int]:
    """Row of the test sample nearest to the middle rank of severity, for each concept, of one object."""
    distance_S = np.full(len(registrations), np.inf)  # of ranks from the middle rank; infinite: is not shown
    for concept, names in SEVERITIES_OF.items():
        rows = np.flatnonzero((registrations.split == "test") & (registrations.concept == concept))
        ranks = [mean_ranks(getattr(registrations, f"severity_{name}")[rows]) / (len(rows) + 1) for name in names]
        distance_S[rows] = np.abs(np.array(ranks) - 0.5).max(axis=0)
    choices = []
    for name in dict.fromkeys(registrations.object_name.tolist()):
        is_object_S = np.isfinite(distance_S) & (registrations.object_name == name)
        by_concept = {c: np.flatnonzero(is_object_S & (registrations.concept == c)) for c in SEVERITIES_OF}
        if all(len(rows) for rows in by_concept.values()):
            choices.append({concept: int(rows[np.argmin(distance_S[rows])]) for concept, rows in by_concept.items()})
    if not choices:
        raise InputError(path, "has no test sample of each concept for any object", "generate more")
    return min(choices, key=lambda samples: max(distance_S[sample] for sample in samples.values()))


@figure(
    SECTION,
    "Objects: {source}",
    """Every object of the source, drawn from its canonical cloud: the registrations are made from these. The paper has
    no such figure.""",
    name="objects_{source}",
    objects_npz="objects/{source}.npz",
)
def objects_of_source(run: Run, objects_npz: Path, source: str) -> Figure:
    from gpca.reporting.figures.contact_sheet import draw_contact_sheet

    return draw_contact_sheet(objects_npz, run.source_titles[source], run.datasets[source])
