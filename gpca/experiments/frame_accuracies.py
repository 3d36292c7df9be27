"""Accuracies on depth frames by seed and with intervals over scenes."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gpca.attribution.diagnostics import brier_score, calibration_error, negative_log_likelihood
from gpca.attribution.metrics import attribution_metrics
from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.declarations import Frame, Paths, Run, numbers
from gpca.evaluation.measures import ALL, Clustered, by_value, intervals, source_method_seed, tidy
from gpca.experiments.frame_labels import collect_labels
from gpca.experiments.frames import TOGETHER, reduced_backbones
from gpca.pairs.dataset import read_samples_of_frames

SEEN, UNSEEN, DATASET = "seen", "unseen", "dataset/"  # beside `TOGETHER` in the column `table`
SAMPLE = ["seed", "sample"]
FRAME_FILES = {
    "prediction_files": "predictions/{frame_prediction}.csv",
    "pose_files": "poses/{posed_frames}/seed{seed}.csv",
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
        yield source, method, seed, concepts_of(rows), {name: test[of_N] for name, of_N in chosen.items() if of_N.any()}


@numbers("real_world_intervals.csv", **FRAME_FILES)
def collect_intervals(run: Run, prediction_files: Paths, pose_files: Paths) -> Frame:
    """Accuracies of `real_world.csv` over all seeds, with 95 % intervals (:mod:`gpca.evaluation.measures`).

    A ``difference`` is from the first method in the same seeds, where both have the same samples. Clusters are scenes;
    the methods of a source share the draws.
    """
    import pandas as pd

    first = reduced_backbones(run.config["real_world"])[0]
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
        chosen = {(TOGETHER, concept): of_N for concept, of_N in by_concept.items()}
        parts = rows.columns[rows.columns.get_loc("right") + 1 :]
        chosen |= {(name, ALL): rows[name].eq(True).to_numpy() for name in parts}
        for (table, part), of_N in chosen.items():
            own = samples.subset(of_N)
            records.append(own.record((table, source, method, "accuracy", part), own.share(right_N[of_N])))
        other = together.get((source, first), rows.iloc[:0])
        other = other[other["seed"].isin(rows["seed"])].reset_index(drop=True)  # some methods have fewer seeds
        if method != first and rows[SAMPLE].equals(other[SAMPLE]):
            apart = samples.difference(rows["right"].to_numpy(), other["right"].to_numpy())
            records.append(samples.record((TOGETHER, source, method, "difference", ALL), apart))
    return intervals(records, "predictions")
