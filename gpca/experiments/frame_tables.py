"""Accuracies on depth frames, by seed and with intervals over scenes; Table VI, and by seen and unseen objects."""

from collections.abc import Iterator
from itertools import product
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from gpca.attribution.diagnostics import brier_score, calibration_error, negative_log_likelihood
from gpca.attribution.metrics import attribution_metrics
from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.declarations import Frame, Paths, Run, numbers, table
from gpca.encoders.registry import make_encoder, parameter_count
from gpca.evaluation.intervals import TRIVIAL
from gpca.evaluation.measures import ALL, Clustered, by_value, intervals, source_method_seed, tidy
from gpca.experiments import frames as frame_rows
from gpca.experiments.frame_labels import collect_labels
from gpca.experiments.frames import CLASSIC, REDUCTIONS, TOGETHER, title_of_frames
from gpca.explainers.registry import explainer_entry
from gpca.frames.source import ONE_ENCODER, REAL_WORLD, conditions_of
from gpca.pairs.dataset import read_samples_of_frames
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.sheet import Column, Row, Sheet, cell_of_repeats, crossed, plain_cell, show, where, with_label
from gpca.reporting.words import dataset_in_words

SEEN, UNSEEN, DATASET = "seen", "unseen", "dataset/"  # beside `TOGETHER` in the column `table`
SAMPLE = ["seed", "sample"]
FRAME_FILES = {
    "prediction_files": "predictions/{frame_prediction}.csv",
    "pose_files": "poses/{frame_pose}.csv",
}


@numbers(
    "real_world.csv",
    **FRAME_FILES,
    one_encoder_files="predictions/{one_encoder_prediction}.csv",
    label_files="frame_labels/{frames}/{frame_label_strategy}/seed{frame_label_seed}.csv",
)
def collect(
    run: Run, prediction_files: Paths, pose_files: Paths, one_encoder_files: Paths = (), label_files: Paths = ()
) -> Frame:
    """Metrics by seed of prediction files, below them of classifiers on one encoder's embeddings, and of labels.

    The column `table` says of which test samples (:func:`parts_by_file`). Beside the metrics of
    :func:`gpca.attribution.metrics.collect` stand `ece`, the number of `objects`, `nll` (nats) and `brier`.
    """
    import pandas as pd

    records = []
    for source, method, seed, concepts, parts in parts_by_file(prediction_files, pose_files):
        for name, test in parts.items():
            true_N = np.array([concepts.index(concept) for concept in test["concept_true"]])
            scores = test[[f"score_{concept}" for concept in concepts]].to_numpy(float), true_N
            of_all = {"ece": calibration_error(*scores), "objects": test["object"].nunique()}
            of_all |= {"nll": negative_log_likelihood(*scores), "brier": brier_score(*scores)}
            metrics = attribution_metrics(test, concepts) | {metric: {ALL: v} for metric, v in of_all.items()}
            for metric, of_concept in metrics.items():
                records += [(name, source, method, metric, c, seed, float(v)) for c, v in of_concept.items()]
    for path in one_encoder_files:
        source, method, seed = source_method_seed(path)
        rows = read_predictions(path)
        metrics = attribution_metrics(rows[rows["split"] == "test"], concepts_of(rows))
        records += [(TOGETHER, source, method, "accuracy", ALL, seed, metrics["accuracy"][ALL])]
    labels = collect_labels(label_files, run.config["frame_labels"]["targets"]) if label_files else []
    return pd.concat([tidy(records, "predictions"), *labels], ignore_index=True)


def parts_by_file(
    prediction_files: Paths, pose_files: Paths
) -> Iterator[tuple[str, str, int, list[str], dict[str, Frame]]]:
    """Source, method, seed and concepts of each file of predictions, and its test rows by part.

    ``attribution`` is all of them, ``seen`` those of objects that a training sample shows, ``unseen`` the others,
    ``dataset/{name}`` those of one dataset's frames.
    """
    poses = {(Path(path).parts[-2], Path(path).stem): path for path in pose_files}
    for path in prediction_files:
        source, method, seed = source_method_seed(path)
        rows, samples = read_predictions(path), read_samples_of_frames(poses[source, f"seed{seed}"])
        test = rows[rows["split"] == "test"]
        shown = samples[samples["split"] == "test"].set_index("sample").loc[test["sample"]]
        in_training, dataset = shown["in_training"].to_numpy(bool), shown["dataset"].to_numpy()
        chosen = {TOGETHER: np.ones(len(test), bool), SEEN: in_training, UNSEEN: ~in_training}
        chosen |= {f"{DATASET}{name}": dataset == name for name in np.unique(dataset)}
        yield source, method, seed, concepts_of(rows), {name: test[in_N] for name, in_N in chosen.items() if in_N.any()}


@numbers("real_world_intervals.csv", **FRAME_FILES)
def collect_intervals(run: Run, prediction_files: Paths, pose_files: Paths) -> Frame:
    """Accuracies of `real_world.csv` over all seeds, with 95 % intervals (:mod:`gpca.evaluation.measures`).

    A ``difference`` is from the first method in the same seeds, where both have the same samples. Clusters are scenes;
    the methods of a source share the draws.
    """
    import pandas as pd

    first = frame_rows.reduced_backbones(run.config["real_world"])[0]
    frames: dict[tuple[str, str], list[Frame]] = {}
    for source, method, seed, _, parts in parts_by_file(prediction_files, pose_files):
        test = parts.pop(TOGETHER)
        is_in = {name: test.index.isin(part.index) for name, part in parts.items()}
        right = (test["concept_true"] == test["concept_predicted"]) & ~test["abstained"]
        frames.setdefault((source, method), []).append(test.assign(seed=seed, right=right, **is_in))
    together = {key: pd.concat(of_seeds, ignore_index=True) for key, of_seeds in frames.items()}
    records = []
    for (source, method), rows in together.items():
        samples, right_N = Clustered.drawn(rows["seed"], rows["cluster"], "frame intervals", source), rows["right"]
        by_concept = by_value(rows, "concept_true", rows["concept_true"].unique())
        chosen = {(TOGETHER, concept): mask_N for concept, mask_N in by_concept.items()}
        parts = rows.columns[rows.columns.get_loc("right") + 1 :]
        chosen |= {(name, ALL): rows[name].eq(True).to_numpy() for name in parts}
        for (name, concept), mask_N in chosen.items():
            inside = samples.subset(mask_N)
            records.append(inside.record((name, source, method, "accuracy", concept), inside.share(right_N[mask_N])))
        other = together.get((source, first), rows.iloc[:0])
        other = other[other["seed"].isin(rows["seed"])].reset_index(drop=True)  # some methods have fewer seeds
        if method != first and rows[SAMPLE].equals(other[SAMPLE]):
            apart = samples.difference(rows["right"].to_numpy(), other["right"].to_numpy())
            records.append(samples.record((TOGETHER, source, method, "difference", ALL), apart))
    return intervals(records, "predictions")


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
        {name: frame_rows.BACKBONES.get(name, name) for name in names}
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
    embedded = (*frame_rows.reduced_backbones(section), *frame_rows.published_backbones(section))
    methods = {name: frame_rows.encoder_title(*name.split("-")) for name in embedded} | CLASSIC
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
