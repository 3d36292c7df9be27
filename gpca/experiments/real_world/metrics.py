"""Metrics on depth frames: of all test samples, of objects that training saw and did not see, and of each dataset."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.diagnostics import brier_score, calibration_error, negative_log_likelihood
from gpca.attribution.metrics import attribution_metrics
from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.errors import InputError
from gpca.evaluation.measures import ALL, read_metrics, source_method_seed, tidy
from gpca.experiments.frame_labels import collect_labels
from gpca.frames.source import REAL_WORLD
from gpca.pairs.dataset import read_samples_of_frames

if TYPE_CHECKING:
    import pandas as pd

TOGETHER, SEEN, UNSEEN, DATASET = "attribution", "seen", "unseen", "dataset/"  # in the column `table`


def collect(
    prediction_files: Iterable[str | Path],
    pose_files: Iterable[str | Path],
    one_encoder_files: Iterable[str | Path] = (),
    label_files: Sequence[str | Path] = (),
    targets: Sequence[float] = (),
) -> pd.DataFrame:
    """Return the tidy metrics of prediction files named ``…/{source}/{method}/seed{seed}.csv``.

    The column `table` says of which test samples: ``attribution`` is all of them, ``seen`` those of objects that a
    training sample shows, ``unseen`` the others, ``dataset/{name}`` those of one dataset's frames. What has no sample
    has no row. Beside the metrics of :func:`gpca.attribution.metrics.collect` stand the calibration error `ece`, the
    number of `objects`, and the proper scores `nll` (nats) and `brier`.

    Args:
        pose_files: named ``…/{source}/seed{seed}.csv``, of every source and seed among the predictions.
        one_encoder_files: predictions of several classifiers on one encoder's embeddings, which are not parted.
        label_files, targets: of :func:`gpca.experiments.frame_labels.collect_labels`, whose metrics stand below.

    Raises:
        InputError: no files, a name of another form, files that do not belong together, what their readers refuse.
    """
    import pandas as pd

    poses = {(Path(path).parts[-2], Path(path).stem): path for path in pose_files}
    records = []
    for path in prediction_files:
        source, method, seed = source_method_seed(path)
        if (of_source := poses.get((source, f"seed{seed}"))) is None:
            raise InputError(path, "has no pose file beside it", "regenerate both from the same config")
        rows = read_predictions(path)
        for name, test in parts_of_frames(path, rows[rows["split"] == "test"], of_source):
            metrics = attribution_metrics(test, concepts_of(rows))
            scores = _scores(test, concepts_of(rows))
            metrics |= {"ece": {ALL: calibration_error(*scores)}, "objects": {ALL: test["object"].nunique()}}
            metrics |= {"nll": {ALL: negative_log_likelihood(*scores)}, "brier": {ALL: brier_score(*scores)}}
            for metric, of_concept in metrics.items():
                records += [(name, source, method, metric, c, seed, float(v)) for c, v in of_concept.items()]
    for path in one_encoder_files:
        source, method, seed = source_method_seed(path)
        rows = read_predictions(path)
        metrics = attribution_metrics(rows[rows["split"] == "test"], concepts_of(rows))
        records += [(TOGETHER, source, method, "accuracy", ALL, seed, metrics["accuracy"][ALL])]
    metrics = tidy(records, "predictions")
    return pd.concat([metrics, *collect_labels(label_files, targets)], ignore_index=True) if label_files else metrics


def read_together(path: str | Path) -> pd.DataFrame:
    """Read of a file that :func:`collect` made the rows of Table VI: all test samples of the frames, a seed for each.

    Raises:
        InputError: as :func:`gpca.evaluation.measures.read_metrics` raises it.
    """
    metrics = read_metrics(path)
    return metrics[(metrics["table"] == TOGETHER) & (metrics["source"] == REAL_WORLD)]


def parts_of_frames(path, test: pd.DataFrame, pose_file: str | Path) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield the test rows of a file of predictions: all together, and by what the column `table` of the metrics names.

    Raises:
        InputError: no test rows, or other samples than in the file of poses.
    """
    if test.empty:
        raise InputError(path, "has no test rows", "regenerate it")
    samples = read_samples_of_frames(pose_file)
    samples = samples[samples["split"] == "test"].set_index("sample")
    if not set(test["sample"]) <= set(samples.index):
        raise InputError(pose_file, f"lacks samples of {path}", "regenerate both from the same config")
    shown = samples.loc[test["sample"]]
    in_training, dataset = shown["in_training"].to_numpy(bool), shown["dataset"].to_numpy()
    yield TOGETHER, test
    chosen = {SEEN: in_training, UNSEEN: ~in_training}
    chosen |= {f"{DATASET}{name}": dataset == name for name in np.unique(dataset)}
    yield from ((name, test[rows]) for name, rows in chosen.items() if rows.any())


def _scores(test: pd.DataFrame, concepts: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return the scores (N, C) and the numbers of the true concepts (N,)."""
    scores_N_C = test[[f"score_{concept}" for concept in concepts]].to_numpy(float)
    return scores_N_C, np.array([concepts.index(concept) for concept in test["concept_true"]])
