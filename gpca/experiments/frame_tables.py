"""Tables of depth frames: Table VI, by backbone and reduction, and by seen and unseen objects."""

from itertools import product
from math import inf
from typing import Any

from gpca.declarations import Run, table
from gpca.encoders.registry import make_encoder, parameter_count
from gpca.evaluation.intervals import TRIVIAL
from gpca.evaluation.measures import ALL
from gpca.experiments import frames
from gpca.experiments.frame_accuracies import DATASET, SEEN, UNSEEN
from gpca.experiments.frames import CLASSIC, REDUCTIONS, TOGETHER, title_of_frames
from gpca.explainers.registry import explainer_entry
from gpca.frames.source import ONE_ENCODER, REAL_WORLD, conditions_of
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.sheet import Column, Row, Sheet, cell_of_repeats, crossed, plain_cell, show, where, with_label
from gpca.reporting.words import dataset_in_words

SCENES = "scenes"  # the clusters
EVERYTHING_SEEN = {TOGETHER: "All (%)", SEEN: "Seen objects (%)", UNSEEN: "Unseen objects (%)"}
POSES = {"results": "Pose estimators", "true_pose": "True pose, small error"}  # titles by form
NUMBERS = {"intervals": "real_world_intervals.csv", "metrics": "real_world.csv"}
SECTION = "IV-D Ablation studies"
SPREAD: dict[str, Any] = {"decimals": 2, "interval": False, "limits": (0.0, inf)}
NOT_SHARES = {  # of which there is one number for all samples
    "ece": Column("ECE, all (share)", decimals=2, interval=False, limits=(0.0, 1.0)),
    "nll": Column("NLL, all (nats)", **SPREAD),
    "icp_calls": Column("ICP calls", decimals=0, interval=False, limits=(0.0, inf)),
}


@table(
    SECTION,
    "Table VI: backbones and reductions",
    """Table VI of the paper: accuracy of GP-CA on objects in depth frames, by encoder and by reduction of the
    embedding, with the paper's classic features below. Beside each share are its interval and the standard
    deviation, which the paper prints.""",
    paper=True,
    **NUMBERS,
)
def table6_backbones(run: Run, intervals, metrics):
    section, encoders = run.config["real_world"], run.config["encoders"]
    judged, published = (
        {name: frames.BACKBONES.get(name, name) for name in names}
        for names in (section["backbones"], section["published"].values())
    )
    untrained = run.titles(explainer_entry, [name for name in section["explainers"] if name in TRIVIAL])
    of_frames = {"table": TOGETHER, "source": REAL_WORLD}
    reductions = {name: REDUCTIONS[name] for name in section["reductions"]}
    rows = [
        Row([encoder, reduction], of_frames | {"method": f"{encoder[0]}-{reduction[0]}"}, rival=encoder[0] in judged)
        for encoder, reduction in product((judged | published).items(), reductions.items())
    ]
    none = ("none", REDUCTIONS["none"])
    rows += [Row([each, none], of_frames | {"method": each[0]}) for each in (CLASSIC | untrained).items()]
    parameters = {
        name: parameter_count(make_encoder(encoders[name]["backbone"], encoders[name].get("options", {})))
        for name in judged | published
    }

    def more(row: Row, subset):
        counts = subset.iloc[0][["seeds", "samples"]].astype(int)
        cells = {}
        for key, source, samples in (("classifiers", ONE_ENCODER, 0), ("deviation", REAL_WORLD, counts["samples"])):
            accuracies = where(metrics, {**row.where} | {"source": source, "metric": "accuracy", "concept": ALL})
            if len(accuracies) > 1:
                deviation = float((accuracies["value"].to_numpy() * 100).std(ddof=1))
                cells[key] = plain_cell(deviation, len(accuracies), samples)
        if (encoder := row.labels[0][0]) in parameters:
            cells["parameters"] = plain_cell(parameters[encoder] / 1000, *counts)
        return cells

    rival = f"To {next(iter(judged.values()))}"
    columns = {
        "accuracy": show("accuracy", "Mean acc. (%)"),
        "classifiers": Column("Std. dev. (%)", **SPREAD),
        "deviation": Column("Of all (%)", **SPREAD),
        "difference": show("difference", f"{rival} (points)", limits=(-100, 100)),
        **{name: show("accuracy", f"{name.capitalize()} (%)", name, interval=False) for name in CONCEPTS},
        "parameters": Column("Parameters (k)", decimals=0, interval=False, limits=(0, inf)),
    }
    heads = {"backbone": "Backbone", "reduction": "Reduction"}
    sheet = Sheet("table6_backbones", heads, rows, columns, intervals, more=more)
    shown = sheet.cells[0, "accuracy"]
    unjudged = f"{', '.join(published.values())}: readings of which architecture the paper used, not compared with it."
    reduction, encoder = section["reductions"][0], "pretrained encoder" if section["pretraining"] else "encoder"
    other = " without reduction" if reduction == "none" else f" with {REDUCTIONS[reduction]}"
    notes = (
        f"{sheet.over(shown.test_samples // shown.seeds, SCENES)}. Training sees none of these scenes. Each seed has "
        f"its own split of the scenes, perturbations, {encoder}, and GPC.",
        "Std. dev.: as the paper says, of classifiers on one encoder's embeddings, the first seed's. Of all: of "
        "the seeds of the accuracy.",
        f"{rival}: paired difference to it{other}. By concept: the share of its samples that is attributed to it. "
        "Parameters: of the encoder.",
        *([unjudged] if published else ()),
    )
    caption = f"GP-CA by backbone and dimensionality reduction, accuracy (%) on {title_of_frames(run.config)}"
    return sheet.table(caption, "metric", notes, bold=["accuracy"], keep_empty=True)


@table(
    SECTION,
    "Depth frames: seen and unseen objects, datasets, real initial poses",
    """The rows of Table VI, split into objects that training saw and did not see, by dataset, and with initial poses
    of real estimators.""",
    **NUMBERS,
)
def table6_seen_unseen(run: Run, intervals, metrics):
    section = run.config["real_world"]
    poses = {REAL_WORLD: section["initial_pose"]}
    poses |= {f"{REAL_WORLD}_{name}": entry for name, entry in conditions_of(run.config).items()}
    conditions = {name: POSES.get(entry.get("form", ""), "Global registration") for name, entry in poses.items()}
    embedded = (*frames.reduced_backbones(section), *frames.published_backbones(section))
    methods = {name: frames.encoder_title(*name.split("-")) for name in embedded} | CLASSIC
    methods |= run.titles(explainer_entry, section["explainers"])
    reads = {name: explainer_entry("gpca" if name in embedded else name).sight for name in methods}
    rows = with_label(crossed(("source", conditions), ("method", methods)), lambda row: reads[row.where["method"]])
    columns = {name: show("accuracy", title, where={"table": name}) for name, title in EVERYTHING_SEEN.items()}
    for name in sorted({name for name in intervals["table"] if name.startswith(DATASET)}):
        title = f"{dataset_in_words(name.removeprefix(DATASET))} (%)"
        columns[name] = show("accuracy", title, where={"table": name}, interval=False)

    def more(row: Row, _subset):
        of_all = where(metrics, {**row.where} | {"table": TOGETHER, "concept": ALL}).set_index("metric")["value"]
        samples = int(of_all[of_all.index == "test_samples"].sum())
        return {metric: cell_of_repeats(of_all[of_all.index == metric].to_numpy(), samples) for metric in NOT_SHARES}

    heads = {"condition": "Initial poses", "method": "Method", "reads": "Reads"}
    sheet = Sheet("table6_seen_unseen", heads, rows, columns | NOT_SHARES, intervals, more=more)
    first = where(intervals, {"source": REAL_WORLD, "metric": "accuracy", "concept": ALL})
    samples = first.groupby("table")["samples"].sum()
    seen, unseen = (f"{100 * samples.get(name, 0) / samples.get(TOGETHER, inf):.0f} %" for name in (SEEN, UNSEEN))
    renders_all = (section["virtual"] or {}).get("objects") == "all"
    rendered = " The pretraining renders the models of both." if renders_all else ""
    notes = (
        f"{sheet.over(clusters=SCENES)}. Shares of the test samples of all seeds together, as some seeds "
        "have more of a column than others. Bold: best for one kind of initial poses.",
        f"No scene is in both training and test. Seen objects ({seen} of the test samples) are shown in a scene of the "
        f"training too, unseen ones ({unseen}) are not.{rendered}",
        "ECE: expected calibration error, NLL: mean negative log likelihood; means over the seeds. Reads: what a "
        "method sees of a registration. ICP calls: runs beyond the one that it explains.",
    )
    caption = f"Accuracy (%) on {title_of_frames(run.config)}: objects that training saw and did not see"
    return sheet.table(caption, "samples", notes, bold=EVERYTHING_SEEN, same=1, keep_empty=True)
