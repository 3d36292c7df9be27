"""Figure 4: online inference (top) and one round of active learning (bottom), from the files of a run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gpca.active_learning.acquisition import EXPANSION, select, top
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.declarations import Figure, Frame, Run, figure
from gpca.errors import InputError
from gpca.evaluation.measures import source_method_seed
from gpca.experiments import registration_stages as drawing
from gpca.experiments.frames import encoder_title
from gpca.experiments.label_curves import STYLES, mean_curves
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures import style
from gpca.reporting.figures.cloud_views import draw_clouds, thinned
from gpca.reporting.figures.diagram import Canvas
from gpca.seeds import generator

ORDER = ("overlap", "pose", "noise")  # shown is the first with a failed registration, learned the first held out
TITLES = {"bald_kmeans": "BALD + $k$-means", "random": "random"}  # strategies whose curves are drawn
STRATEGY = "bald_kmeans"  # the paper's
SETTING = "pretrained"  # the encoder knows all concepts, and the classifier all but one
THUMBNAILS = 6  # number of clouds of the pool that are drawn


@figure(
    "III Gaussian process concept attribution",
    "Figure 4: pipeline",
    """After Figure 4 of the paper: what happens to one registration (online inference), and how a batch of labels is
    chosen and learned (active learning). The sample above is chosen as in Figure 2. Below is the first round of the run
    in which a concept is new; its pool is the training samples without a label.""",
    paper=True,
    only={"pool_strategy": tuple(TITLES)},
    **drawing.FILES,
    curve_files="active_learning/{shown_source}/{pool_strategy}/seed{seed}.csv",
)
def fig4_pipeline(
    run: Run, registrations: Path, embeddings: Path, predictions: Path, uncertainties: Path, curve_files: Sequence[Path]
) -> Figure:
    stages = drawing.Staged.load(registrations, embeddings, predictions, uncertainties, run.config["causes"]["limits"])
    row = stages.choose(ORDER[0], registrations, *ORDER[1:])
    new, curves = _curves(curve_files)
    source, _, seed = source_method_seed(curve_files[0])
    settings = ActiveLearningSettings.from_dict(dict(run.config["active_learning"]))
    labeling = first_round(stages, new, settings, source, seed)
    canvas = Canvas(style.TEXT_WIDTH_IN, 3.5)
    canvas.box(0.03, 1.9, 7.1, 1.4, color=style.LIGHT_GRAY)
    canvas.box(0.03, 0.03, 7.1, 1.6, color=style.LIGHT_GRAY)
    _draw_inference(canvas, stages, row, encoder_title(**run.config["embedding"]), labeling)
    _draw_active_learning(canvas, stages, labeling, new, curves)
    canvas.arrow((6.4, 1.97), (6.4, 1.63))
    canvas.text(6.36, 1.765, "uncertain cases", ha="right", va="center")
    canvas.arrow((0.9, 1.63), (0.9, 1.74), (4.62, 1.74), (4.62, 2.0))
    canvas.text(2.76, 1.775, "retrained classifier", va="bottom")
    style.write_title(canvas.figure, drawing.title_of_sample(run, stages.predictions["object"][row]))
    canvas.dot(6.15, 3.4, style.TARGET_COLOR, r"target $\mathcal{Q}$", gap_in=0.05)
    canvas.dot(6.63, 3.4, style.SOURCE_COLOR, r"source $\mathcal{P}$", gap_in=0.05)
    return canvas.figure


@dataclass(frozen=True)
class Round:
    """The first round of labels, with the pool's N training samples."""

    rows_N: np.ndarray  # of the pool
    labeled: np.ndarray  # rows that were labeled at the start, none of the new concept
    map_S_2: np.ndarray  # principal components of all embeddings, fitted to the standardized ones of the training
    bald_N: np.ndarray  # of the pool in nats, by the classifier that knows all concepts but the new one
    candidates: np.ndarray  # indices into `rows_N` of the B·K largest BALD
    chosen: np.ndarray  # and of the B of them that k-means keeps


def first_round(
    stages: drawing.Staged, held_out: str, settings: ActiveLearningSettings, source: str, seed: int
) -> Round:
    """Fit the classifier that does not know a concept yet, as learning curves do, and choose from the pool."""
    from sklearn.decomposition import PCA
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    from gpca.active_learning.rounds import initial_gpc, make_task, pool_of

    samples = stages.registrations
    row_S_1 = np.arange(len(samples))[:, None]
    row_task, task = (
        make_task(replace(samples, attached={"embedding": each}), held_out, settings, source, seed)
        for each in (row_S_1, stages.h_S_d)
    )
    gpc = initial_gpc(task, settings, source, seed, SETTING)
    rows_N, labeled = row_task.pool.h[:, 0], row_task.initial.h[:, 0]
    pool = pool_of(task.project(gpc), gpc, np.arange(len(rows_N)), [])
    random = generator(source, seed, SETTING, "active_learning", held_out, STRATEGY)
    chosen = select(STRATEGY, pool, settings.batch, random)
    to_map = make_pipeline(StandardScaler(), PCA(2, svd_solver="full")).fit(stages.h_S_d[samples.rows("train")])
    map_S_2, candidates = to_map.transform(stages.h_S_d), top(pool.bald_N, settings.batch * EXPANSION)
    return Round(rows_N, labeled, map_S_2, pool.bald_N, candidates, chosen)


def _curves(files: Sequence[Path]) -> tuple[str, dict[str, Frame]]:
    """Concept that was new, and the learning curves of that experiment by strategy."""
    for concept in ORDER:
        curves = {name: one for (_, name, setting), one in mean_curves(files, [concept]).items() if setting == SETTING}
        if any(name in curves for name in TITLES):
            return concept, curves
    raise InputError("active learning", f"has no curve of {' or '.join(TITLES)}", "run one of these strategies")


def _draw_inference(canvas: Canvas, stages: drawing.Staged, row: int, encoder: str, labeling: Round) -> None:
    sample = stages.predictions.iloc[row]
    middle_in, captions_in = 2.66, 2.17
    canvas.text(0.1, 3.27, "Online inference", ha="left", va="top", fontweight="bold")
    seen = stages.seen(row)
    corners = np.concatenate([np.concatenate(pair) for pair in seen.values()])
    captions = {"init": "initial pose $T_0$:\n", "icp": r"aligned $\hat{T}\mathcal{P}$: "}
    for left_in, (which, pair) in zip((0.12, 1.56), seen.items(), strict=True):
        draw_clouds(canvas.panel(left_in, 2.2, 1.06, 0.94), *pair, 1.0, (corners.min(axis=0), corners.max(axis=0)))
        canvas.text(left_in + 0.53, captions_in, captions[which] + stages.words(row, which), va="top")
    canvas.arrow((1.2, middle_in), (1.54, middle_in), words="ICP")
    canvas.arrow((2.66, middle_in), (2.8, middle_in))
    corners_in = [(2.8, 3.02), (3.3, 2.86), (3.3, 2.46), (2.8, 2.3)]
    canvas.axes.fill(*zip(*corners_in, strict=True), facecolor=style.GRAY + "22", edgecolor=style.GRAY, linewidth=0.9)
    canvas.text(3.05, middle_in, f"{encoder}\n$f_\\theta$", va="center")
    canvas.text(3.05, captions_in, "frozen", va="top")
    canvas.arrow((3.3, middle_in), (3.46, middle_in))
    drawing.draw_embedding(canvas.panel(3.48, 2.3, 0.36, 0.72), stages.h_S_d[row])
    canvas.text(3.66, captions_in, rf"$\mathbf{{h}} \in \mathbb{{R}}^{{{stages.h_S_d.shape[1]}}}$", va="top")
    canvas.arrow((3.86, middle_in), (4.02, middle_in))
    canvas.box(4.02, 2.0, 1.2, 1.22, color=style.BLUE)
    canvas.text(4.62, 3.19, "multi-class GP classifier", va="top")
    panel = canvas.panel(4.07, 2.17, 1.1, 0.88)
    train = stages.registrations.rows("train")
    for concept in CONCEPTS:
        rows = train[stages.registrations.concept[train] == concept]
        look = {"marker": style.CONCEPT_MARKERS[concept], "color": style.CONCEPT_COLORS[concept]}
        panel.scatter(*labeling.map_S_2[rows].T, s=5, alpha=0.6, linewidths=0, **look)
    panel.scatter(*labeling.map_S_2[row], s=45, marker="*", color=style.BLACK, zorder=5)
    panel.set_axis_off()
    canvas.text(4.62, 2.03, "★ this sample", va="bottom")
    canvas.arrow((5.22, middle_in), (5.58, middle_in))
    drawing.draw_scores(canvas.panel(5.96, 2.42, 0.62, 0.62), sample, numbered=True)
    words = rf"$\hat{{s}}_c \pm \sqrt{{v_c}}$;  $\hat{{c}}$ = {sample['concept_predicted']}"
    canvas.text(6.36, captions_in, words, va="top")


def _draw_active_learning(canvas: Canvas, stages: drawing.Staged, labeling: Round, new: str, curves: Mapping) -> None:
    """Draw pool, score, diversify, annotate, retrain from right to left: the way back of the loop."""
    heads_in, captions_in, middle_in = 1.58, 0.08, 0.86
    canvas.text(0.1, heads_in, "Active learning", ha="left", va="top", fontweight="bold")

    canvas.text(6.4, heads_in, r"Unlabeled pool $\mathcal{D}_U$", va="top")
    canvas.text(6.4, captions_in, f"{len(labeling.rows_N)} training samples", va="bottom")
    for i, row in enumerate(thinned(labeling.rows_N, THUMBNAILS)):
        corner = (5.9 + 0.36 * (i % 3), 0.86 - 0.56 * (i // 3))
        _draw_thumbnail(canvas.panel(*corner, 0.34, 0.5), stages, row)
    canvas.arrow((5.84, middle_in), (5.62, middle_in))

    canvas.text(5.04, heads_in, "Score: BALD", va="top")
    panel = canvas.panel(4.5, 0.36, 1.08, 1.02)
    bald_N = labeling.bald_N
    points_N_2 = labeling.map_S_2[labeling.rows_N]
    order = np.argsort(bald_N, kind="stable")
    panel.scatter(*labeling.map_S_2[labeling.labeled].T, s=5, marker="x", color=style.GRAY, linewidths=0.5)
    panel.scatter(*points_N_2[order].T, s=9, c=bald_N[order], cmap=style.blues(), edgecolors=style.GRAY, linewidths=0.3)
    panel.scatter(*points_N_2[labeling.candidates].T, s=26, facecolors="none", edgecolors=style.BLACK, linewidths=0.7)
    panel.set_axis_off()
    words = f"{bald_N.min():.2f} to {bald_N.max():.2f} nats; $B K$ = {len(labeling.candidates)}"
    canvas.text(5.04, captions_in, f"{words}\nringed; ×: labeled before", va="bottom")
    canvas.arrow((4.46, middle_in), (4.24, middle_in))

    canvas.text(3.66, heads_in, "Diversify: $k$-means", va="top")
    panel = canvas.panel(3.12, 0.36, 1.08, 1.02)
    panel.scatter(*points_N_2[labeling.candidates].T, s=26, facecolors="white", edgecolors=style.BLACK, linewidths=0.7)
    panel.scatter(*points_N_2[labeling.chosen].T, s=26, facecolors=style.BLUE, edgecolors=style.BLACK, linewidths=0.7)
    panel.margins(0.12)
    panel.set_axis_off()
    canvas.text(3.66, captions_in, f"$B$ = {len(labeling.chosen)} kept,\none of each cluster", va="bottom")
    canvas.arrow((3.08, middle_in), (2.88, middle_in))

    canvas.text(2.4, heads_in, "Annotate", va="top")
    for i, row in enumerate(labeling.rows_N[labeling.chosen[:4]]):
        corner = (1.98 + 0.44 * (i % 2), 0.94 - 0.6 * (i // 2))
        _draw_thumbnail(canvas.panel(*corner, 0.4, 0.46), stages, row)
        concept = stages.predictions["concept_true"][row]
        canvas.text(corner[0] + 0.2, corner[1] - 0.01, concept, va="top")
    canvas.arrow((1.92, middle_in), (1.72, middle_in))

    canvas.text(1.4, heads_in, f"Retrain: {new} is new", va="top")
    panel = canvas.panel(0.5, 0.38, 1.18, 1.0)
    for name in reversed(TITLES):
        if name in curves:
            color, line, width = STYLES[name]
            look = {"color": color, "linewidth": width, "label": TITLES[name]}
            panel.plot(curves[name]["labels"], curves[name]["mean"], line, **look)
    low, high = panel.get_ylim()
    panel.set_ylim(bottom=low - 0.5 * (high - low))  # room for the legend
    panel.locator_params(axis="x", nbins=4, integer=True)
    panel.set_ylabel("accuracy (%)", fontsize=style.SMALL_PT, labelpad=1)
    panel.set_xlabel("labels", fontsize=style.SMALL_PT, labelpad=0)
    panel.tick_params(pad=1.5, length=2)
    panel.legend(loc="lower right", borderaxespad=0, handlelength=1.2, borderpad=0.1, labelspacing=0.2)


def _draw_thumbnail(axes, stages: drawing.Staged, row: int) -> None:
    target_Q_3, source_P_3 = stages.seen(row)["icp"]
    draw_clouds(axes, target_Q_3[::3], source_P_3[::3], size=0.4)
