"""From predictions to tidy numbers of every source, explainer and seed; an abstained sample counts as wrong."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import TIMING_COLUMNS, concepts_of, read_predictions, require_samples
from gpca.errors import InputError
from gpca.evaluation.measures import ALL, source_method_seed, tidy
from gpca.io.csv_file import numbers, read_csv

if TYPE_CHECKING:
    import pandas as pd

PREDICTED_AS, ABSTAINED = "predicted_as_", "abstained"  # metrics of the confusion: predicted_as_<concept or abstained>
CAUSAL_QUANTILE = 0.95  # above this quantile of the clean uncertainties begins what is not their scatter
_CAUSAL_COLUMNS = ("sample", "split", "uncertainty_observed", "uncertainty_clean")


def concept_accuracy(
    concept_true_S: np.ndarray, concept_predicted_S: np.ndarray, abstained_S: np.ndarray, concepts: Sequence[str]
) -> dict[str, float]:
    """Return the accuracy over `ALL` samples, and over those of each concept that has some (its recall)."""
    right_S = (concept_true_S == concept_predicted_S) & ~abstained_S
    masks = {concept: concept_true_S == concept for concept in concepts}
    by_concept = {concept: float(np.mean(right_S[mask])) for concept, mask in masks.items() if mask.any()}
    return {ALL: float(np.mean(right_S)), **by_concept}


def confusion(
    concept_true_S: np.ndarray, concept_predicted_S: np.ndarray, abstained_S: np.ndarray, concepts: Sequence[str]
) -> np.ndarray:
    """Return counts (C, C + 1): rows the true concepts, columns the predicted ones and, last, the abstained."""
    columns = [(concept_predicted_S == concept) & ~abstained_S for concept in concepts] + [abstained_S]
    return np.array([[np.sum(column & (concept_true_S == true)) for column in columns] for true in concepts])


def read_uncertainties(path: str | Path) -> tuple[pd.Series, float]:
    """Return the uncertainty (nats) of each observed pair by (split, sample), and the clean ones' 95th percentile."""
    import pandas as pd

    rows = read_csv(path, _CAUSAL_COLUMNS, others=("uncertainty_*",))
    require_samples(path, rows)
    limit = numbers(path, rows, "uncertainty_clean").quantile(CAUSAL_QUANTILE)
    samples = pd.MultiIndex.from_frame(rows[["split", "sample"]])
    return numbers(path, rows, "uncertainty_observed").set_axis(samples), float(limit)


def collect(prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the tidy metrics (results/README.md) of prediction files named `…/{source}/{explainer}/seed{seed}.csv`."""
    records = []
    for path in prediction_files:
        source, method, seed = source_method_seed(path)
        test = _test_rows(path, read_predictions(path))
        for metric, values in attribution_metrics(test, concepts_of(test)).items():
            records += [("attribution", source, method, metric, c, seed, float(v)) for c, v in values.items()]
    return tidy(records, "predictions")


def attribution_metrics(test: pd.DataFrame, concepts: list[str]) -> dict[str, dict[str, float]]:
    """Return metric -> concept or `ALL` -> value; a concept without samples has none."""
    true_S, named_S, abstained_S = (
        test[name].to_numpy() for name in ("concept_true", "concept_predicted", "abstained")
    )
    counts = confusion(true_S, named_S, abstained_S, concepts)
    samples = {concept: n for concept, n in zip(concepts, counts.sum(axis=1), strict=True) if n}
    metrics = {
        "accuracy": concept_accuracy(true_S, named_S, abstained_S, concepts),
        "test_samples": {ALL: len(test)} | samples,
        "clusters": {ALL: test["cluster"].nunique()} | test.groupby("concept_true")["cluster"].nunique().to_dict(),
        "abstention_rate": {ALL: test["abstained"].mean()},
        "icp_calls": {ALL: test["icp_calls"].mean()},
    }
    for predicted, column in zip((*concepts, ABSTAINED), counts.T, strict=True):
        metrics[PREDICTED_AS + predicted] = {c: n for c, n in zip(concepts, column, strict=True) if c in samples}
    return metrics


def _test_rows(path: str | Path, rows: pd.DataFrame) -> pd.DataFrame:
    rows = rows[rows["split"] == "test"]
    if rows.empty:
        raise InputError(path, "has no test rows", "regenerate it")
    return rows


def collect_timings(timing_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return mean `seconds_per_sample` and `icp_seconds_per_sample` of test rows, which differ from run to run."""
    records = []
    for path in timing_files:
        source, method, seed = source_method_seed(path)
        test = _test_rows(path, read_csv(path, TIMING_COLUMNS))
        for column in ("seconds", "icp_seconds"):
            mean = float(numbers(path, test, column).mean())
            records.append(("runtime", source, method, f"{column}_per_sample", ALL, seed, mean))
    return tidy(records, "timings")
