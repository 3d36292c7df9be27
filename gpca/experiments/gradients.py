"""Gradients of GP-CA's scores: saliency of points, and TCAV."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gpca.declarations.experiment import Experiment, LeftOut
from gpca.declarations.plan import Run
from gpca.declarations.result import Figure, Frame, Paths, figure, numbers, table
from gpca.declarations.step import Step, encoder_of
from gpca.encoders.registry import DIFFERENTIABLE, DGCNNOptions, EncoderSettings
from gpca.errors import InputError
from gpca.evaluation.measures import ALL, source_method_seed, tidy
from gpca.io.arrays import REAL, WHOLE, load_arrays
from gpca.io.csv_file import read_numbers
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.style import LIGHT_GRAY, SMALL_PT, blues, write_title
from gpca.reporting.sheet import Row, Sheet, Show, crossed, mean_over_seeds, where
from gpca.reporting.tables.builder import mean_over
from gpca.reporting.tables.table import Cell, Column
from gpca.reporting.words import plural
from gpca.steps.gradients import DELETION_COLUMNS, RANDOM, GradientSettings


def check(config: dict, _left_out: LeftOut) -> None:
    encoder = EncoderSettings(**encoder_of(config))
    if encoder.backbone != "dgcnn":
        return
    share, neighbors = max(config["gradients"]["deleted"]), encoder.options.get("k", DGCNNOptions.k)
    if round((1 - share) * encoder.draw_points) < neighbors:
        fault = f"deleting {share:g} of {encoder.draw_points} points leaves fewer than the encoder's {neighbors}"
        raise InputError("config key gradients.deleted", fault, "delete fewer")


EXPERIMENT = Experiment(
    name="gradients",
    sections={"gradients": GradientSettings},
    needs=("gradient_source",),
    names=lambda config, sources: {
        "gradient_source": list(sources) if encoder_of(config)["backbone"] in DIFFERENTIABLE else [],
        "gradient_encoder": config["embedding"]["encoder"],
    },
    check=check,
)

FOLLOW = Step(
    name="follow_gradients",
    run="gpca.steps.gradients",
    inputs={
        "registrations": "registrations/{source}/seed{*seed}.npz",
        "encoders": "encoders/{source}/{gradient_encoder}/seed{*seed}.pt",
        "embeddings": "embeddings/{source}/{gradient_encoder}/none/seed{*seed}.npz",
    },
    outputs={
        "deletions": "saliency/{source}/seed{*seed}.csv",
        "maps": "saliency/{source}/seed{*seed}.npz",
        "tcav": "tcav/{source}/seed{*seed}.csv",
    },
    settings=lambda plan, wildcards: {
        "gradients": plan.config["gradients"],
        "encoder": plan.encoder,
        "gpc": plan.config["explainers"].get("gpca") or {},
    },
    modules=lambda plan: [plan.encoder_module],
    where={"source": "gradient_source"},
    target="gradients",
)

SALIENCY, TCAV = "saliency", "tcav"  # the column `table`
TCAV_VALUES = ("score", "chance", "p", "significant", "probe")


@numbers(
    "gradients.csv",
    rule="gradient_metrics",
    deletions="saliency/{gradient_source}/seed{seed}.csv",
    tests="tcav/{gradient_source}/seed{seed}.csv",
)
def collect(run: Run, deletions: Paths, tests: Paths) -> Frame:
    """Fall of the score by order and share of deleted points, and TCAV's tests, by source and seed."""
    records: list[tuple] = []
    for path in deletions:
        _, source, seed = source_method_seed(path)
        rows = read_numbers(path, DELETION_COLUMNS, ("deleted", "before", "after", "changed"))
        rows["drop"] = rows["before"] - rows["after"]
        means = rows.groupby(["order", "deleted"], sort=False)[["drop", "changed"]].mean()
        for (order, deleted), row in means.iterrows():
            values = dict(row)
            if order != RANDOM and (RANDOM, deleted) in means.index:
                values["excess"] = row["drop"] - means.loc[(RANDOM, deleted), "drop"]
            for name, value in values.items():
                records.append((SALIENCY, source, order, f"{name}_{100 * deleted:g}", ALL, seed, float(value)))
        records += [
            (SALIENCY, source, order, "test_samples", ALL, seed, float(part["sample"].nunique()))
            for order, part in rows.groupby("order", sort=False)
        ]
    for path in tests:
        _, source, seed = source_method_seed(path)
        rows = read_numbers(path, ("tested", "concept", *TCAV_VALUES), TCAV_VALUES)
        records += [
            (TCAV, source, row["tested"], value, row["concept"], seed, float(row[value]))
            for _, row in rows.iterrows()
            for value in TCAV_VALUES
        ]
    return tidy(records, "gradients")


SECTION = "Beyond the paper: what explainers look at, and whether it carries over"


@figure(
    SECTION,
    "Saliency maps",
    """Which points GP-CA's score of the concept that it names reacts to most: the length of the gradient through
    classifier and encoder, by rank among the points of the cloud. The model is gray.

    For each concept, the correctly named test sample with the median score is shown.""",
    needs=("gradient_source",),
    registrations="registrations/{shown_source}/seed{first_seed}.npz",
    maps="saliency/{shown_source}/seed{first_seed}.npz",
    deletions="saliency/{shown_source}/seed{first_seed}.csv",
)
def saliency(run: Run, registrations: Path, maps: Path, deletions: Path) -> Figure:
    loaded = Registrations.load(registrations)
    shapes: dict[str, tuple[int | str, ...]] = {"sample": ("S",), "points": ("S", "N", 3), "saliency": ("S", "N")}
    arrays = load_arrays(maps, shapes, {"sample": WHOLE, "points": REAL, "saliency": REAL})
    rows = read_numbers(deletions, DELETION_COLUMNS, ("before",)).drop_duplicates("sample")
    shown = {}
    for concept in CONCEPTS:
        candidates = rows[rows["concept"] == concept]
        right = candidates[candidates["named"] == concept]
        ordered = (candidates if right.empty else right).sort_values(["before", "sample"], kind="stable")
        if len(ordered):
            shown[concept] = int(ordered["sample"].iloc[(len(ordered) - 1) // 2])
    test = {int(loaded.sample[row]): row for row in loaded.rows("test")}
    numbers_of_maps = {int(sample): i for i, sample in enumerate(arrays["sample"])}
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    from gpca.reporting.figures.cloud_views import widest_views
    from gpca.reporting.figures.panels import panels

    drawing, [axes] = panels(1, len(CONCEPTS), HEIGHT_IN)
    for panel, concept in zip(axes, CONCEPTS, strict=True):
        panel.set_axis_off()
        if concept not in shown:
            continue
        sample = shown[concept]
        points_N_3, saliency_N = (arrays[name][numbers_of_maps[sample]] for name in ("points", "saliency"))
        target_Q_3 = loaded.target(test[sample])
        view = widest_views(target_Q_3)[0]
        target_Q_2, points_N_2 = target_Q_3 @ view.T, points_N_3 @ view.T
        panel.scatter(target_Q_2[:, 0], target_Q_2[:, 1], s=0.6, c=LIGHT_GRAY, linewidths=0)
        order = np.argsort(saliency_N, kind="stable")  # the salient points in front
        colors = {"c": np.linspace(0, 1, len(order)), "cmap": blues(), "vmin": PALEST, "vmax": 1}
        panel.scatter(points_N_2[order, 0], points_N_2[order, 1], s=5, linewidths=0, **colors)
        panel.set_aspect("equal", adjustable="datalim")
        score = rows.loc[rows["sample"] == str(sample), ["named", "before"]].iloc[0]
        panel.set_title(f"{concept}: named {score['named']}, {score['before']:.2f}", fontsize=SMALL_PT + 1)
    bar = drawing.colorbar(
        ScalarMappable(Normalize(PALEST, 1), blues()), ax=axes, shrink=0.75, pad=0.01, ticks=(0, 0.5, 1)
    )
    bar.ax.set_ylim(0, 1)
    bar.set_label("rank of the point's saliency", fontsize=SMALL_PT)
    bar.ax.set_yticklabels(["least", "median", "most"], fontsize=SMALL_PT)
    title = run.source_titles[run.config["figures"]["source"]]
    write_title(drawing, f"{title}: points that GP-CA's score reacts to")
    return drawing


HEIGHT_IN = 2.75
PALEST = -0.25  # rank at which the colors reach white; no point has it


@table(
    SECTION,
    "Deleting the most salient points",
    """How much the score of the concept that GP-CA names falls when points are deleted. A saliency map that shows what
    matters makes it fall more than deleting as many points at random.""",
    needs=("gradient_source",),
    metrics="gradients.csv",
)
def saliency_deletion(run: Run, metrics):
    columns: dict[str, Column] = {}
    for percent in [f"{100 * share:g}" for share in run.config["gradients"]["deleted"]]:
        drop, limits = f"drop_{percent}", (-100, 100)
        excess, changed = f"excess_{percent}", f"changed_{percent}"
        columns[drop] = Show(f"Fall without {percent} % (points)", where={"metric": drop}, limits=limits)
        columns[excess] = Show(f"beyond random, {percent} %", where={"metric": excess}, limits=limits, beside=drop)
        columns[changed] = Show(f"Named otherwise (%), {percent} %", where={"metric": changed}, interval=False)
    rows = crossed(("source", run.source_titles), ("method", ORDERS))
    heads, numbers_of_table = {"source": "Dataset", "order": "Deleted"}, where(metrics, {"table": SALIENCY})
    sheet = Sheet("saliency_deletion", heads, rows, columns, numbers_of_table, cell=mean_over_seeds)
    notes = (
        f"{mean_over(sheet.seeds, run.config['gradients']['samples'])}; one draw of points of each sample.",
        "Fall: of the score of the concept named on the whole draw, in hundredths; in brackets the excess over "
        "random deletion. To the center: in the order of how much moving a point to the center changes the score "
        "(Zheng et al. 2019). At random: mean of four orders.",
    )
    caption = "Fall of GP-CA's score without some of the points" + sheet.stand_in_clause(run.sources, partly=False)
    return sheet.table(caption, "quantity", notes, keep_empty=True)


ORDERS = {
    "gradient": "Most salient first",
    "to_centre": "Most salient first (to the center)",
    "random": "At random",
    "least_gradient": "Least salient first",
}


@table(
    SECTION,
    "TCAV: which concepts the classes of GP-CA rely on",
    """The share of a class's test samples (columns) for which moving the embedding along a concept (rows) raises the
    log odds of that class, with a test against random directions. TCAV describes a whole class, not a sample; the
    concept activation vectors of the extended Table I use the same vectors sample by sample.""",
    needs=("gradient_source",),
    metrics="gradients.csv",
)
def tcav(run: Run, metrics):
    tests = where(metrics, {"table": TCAV})
    columns: dict[str, Column] = {}
    for name in dict.fromkeys(tests["concept"]):
        of_class = {"metric": "score", "concept": name}
        columns[f"score_{name}"] = Show(f"Class {name} (%)", where=of_class, of_samples=False)
        columns[f"significant_{name}"] = Column(f"seeds, {name}", decimals=0, interval=False)
    columns["probe"] = Show("Probes right (%)", where={"metric": "probe"})

    def significant(_row: Row, subset: Frame) -> dict[str, Cell]:
        by_class = where(subset, {"metric": "significant"}).groupby("concept")["value"]
        return {f"significant_{name}": Cell(float(each.sum()), 0.0, len(each), 0) for name, each in by_class}

    rows = crossed(("source", run.source_titles), ("method", {name: name for name in tests["method"]}))
    heads = {"source": "Dataset", "tested": "Concept"}
    sheet = Sheet("tcav", heads, rows, columns, tests, more=significant, cell=mean_over_seeds)
    settings = run.config["gradients"]
    notes = (
        f"Means over {plural(sheet.seeds, 'seed')}; {settings['vectors']} probes for each concept.",
        "Score: share of the test samples of the class whose log odds of it grow along the concept; about half "
        "if there is no relation. Seeds: in how many of them it differs from the scores of random probes, at the "
        f"level {settings['level']:g} over all tests of a seed (Bonferroni). Probes right: accuracy on training "
        "samples that the probe did not learn, the mean of those with and without the concept.",
    )
    caption = "TCAV's scores for GP-CA" + sheet.stand_in_clause(run.sources, partly=False)
    return sheet.table(caption, "quantity", notes, keep_empty=True)
