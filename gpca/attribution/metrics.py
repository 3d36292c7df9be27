"""From predictions to numbers: over the test rows of every source, explainer and seed, as one tidy table.

An abstained sample counts as wrong, so that an explainer cannot gain by staying silent.
"""

from __future__ import annotations

from collections.abc import Iterable
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


def accuracy(concept_true_S: np.ndarray, concept_predicted_S: np.ndarray, abstained_S: np.ndarray) -> float:
    """Return the share in [0, 1] of the S samples whose concept was named and right; S = 0 raises ValueError."""
    if len(concept_true_S) == 0:
        raise ValueError("accuracy of no samples")
    return float(np.mean((concept_true_S == concept_predicted_S) & ~abstained_S))


def concept_accuracy(
    concept_true_S: np.ndarray, concept_predicted_S: np.ndarray, abstained_S: np.ndarray, concepts: Iterable[str]
) -> dict[str, float]:
    """Return for each concept the accuracy over the samples that truly are of it (its recall).

    A concept without samples is left out: its accuracy is not defined.
    """
    of_concept = {concept: concept_true_S == concept for concept in concepts}
    return {
        concept: accuracy(concept_true_S[mask], concept_predicted_S[mask], abstained_S[mask])
        for concept, mask in of_concept.items()
        if mask.any()
    }


def confusion(
    concept_true_S: np.ndarray, concept_predicted_S: np.ndarray, abstained_S: np.ndarray, concepts: Iterable[str]
) -> np.ndarray:
    """Return counts (C, C + 1): rows the true concepts, columns the predicted ones and, last, the abstained."""
    concepts = list(concepts)
    columns = [(concept_predicted_S == concept) & ~abstained_S for concept in concepts] + [abstained_S]
    return np.array([[np.sum(column & (concept_true_S == true)) for column in columns] for true in concepts])


def permuted_accuracy(confusion_C_C1: np.ndarray) -> float:
    """Return the largest accuracy over all one-to-one relabelings of the predicted concepts.

    Far above the plain accuracy it shows that an explainer tells the concepts apart but names them wrongly: an
    artifact of sign or scale. It looks at the truth, so it is an upper bound and never a result: of many balanced
    guesses it is slightly above 1/C. Solved as an assignment (Kuhn 1955).
    """
    from scipy.optimize import linear_sum_assignment

    named_C_C = confusion_C_C1[:, :-1]
    return float(named_C_C[linear_sum_assignment(named_C_C, maximize=True)].sum() / confusion_C_C1.sum())


def read_uncertainties(path: str | Path) -> tuple[pd.Series, float]:
    """Return the uncertainty of each observed pair, and the 95th percentile of that of the clean ones.

    The file holds those of one source and seed (KL divergences in nats, one row per test sample). The first are
    indexed by (split, sample) as text.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a sample twice, an uncertainty not finite.
    """
    rows = read_csv(path, _CAUSAL_COLUMNS, others=("uncertainty_*",))
    require_samples(path, rows)
    limit = numbers(path, rows, "uncertainty_clean").quantile(CAUSAL_QUANTILE)
    return numbers(path, rows, "uncertainty_observed").set_axis(_samples(rows)), float(limit)


def read_causal(path: str | Path) -> pd.Series:
    """Return whether each sample is causal, indexed by (split, sample) as text: something made it uncertain.

    A sample is causal if it is more uncertain than 95 % of the clean pairs.

    Raises:
        InputError: see :func:`read_uncertainties`.
    """
    observed, limit = read_uncertainties(path)
    return observed > limit


def collect(prediction_files: Iterable[str | Path], causal_files: Iterable[str | Path] = ()) -> pd.DataFrame:
    """Return the tidy metrics (`TIDY_COLUMNS`) of prediction files named `…/{source}/{explainer}/seed{seed}.csv`.

    results/README.md lists them; the column `table` is "attribution". Values are shares in [0, 1], counts or means
    per sample. Rows follow the order of the files. Causal metrics are those of the sources and seeds of
    `causal_files`, named `…/{source}/{design}/seed{seed}.csv`; they may hold more samples than an explainer explains.

    Raises:
        InputError: no files, a name of another form, a file that :func:`read_predictions` or :func:`read_causal`
            refuses or that has no test rows, a test sample that the causal file of its source and seed lacks.
    """
    causal = {}
    for path in causal_files:
        source, _, seed = source_method_seed(path)
        causal[source, seed] = (path, read_causal(path))
    records = []
    for path in prediction_files:
        source, method, seed = source_method_seed(path)
        rows = read_predictions(path)
        test = rows[rows["split"] == "test"]
        if test.empty:
            raise InputError(path, "has no test rows", "regenerate it")
        metrics = attribution_metrics(test, concepts_of(rows))
        if (source, seed) in causal:
            metrics |= _causal_metrics(path, test, *causal[source, seed])
        for metric, of_concept in metrics.items():
            records += [("attribution", source, method, metric, c, seed, float(v)) for c, v in of_concept.items()]
    return tidy(records, "predictions")


def attribution_metrics(test: pd.DataFrame, concepts: list[str]) -> dict[str, dict[str, float]]:
    """Return metric -> concept or `ALL` -> value; a concept without samples has none."""
    judged = _judged(test)
    counts = confusion(*judged, concepts)
    samples = {concept: n for concept, n in zip(concepts, counts.sum(axis=1), strict=True) if n}
    metrics = {
        "accuracy": {ALL: accuracy(*judged)} | concept_accuracy(*judged, concepts),
        "test_samples": {ALL: len(test)} | samples,
        "clusters": {ALL: test["cluster"].nunique()} | test.groupby("concept_true")["cluster"].nunique().to_dict(),
        "abstention_rate": {ALL: test["abstained"].mean()},
        "permuted_accuracy": {ALL: permuted_accuracy(counts)},
        "icp_calls": {ALL: test["icp_calls"].mean()},
    }
    for predicted, column in zip((*concepts, ABSTAINED), counts.T, strict=True):
        of_concept = dict(zip(concepts, column, strict=True))
        metrics[PREDICTED_AS + predicted] = {concept: of_concept[concept] for concept in samples}
    return metrics


def _causal_metrics(path, test: pd.DataFrame, causal_path, causal: pd.Series) -> dict[str, dict[str, float]]:
    keys = _samples(test)
    if not (known := keys.isin(causal.index)).all():
        split, sample = keys[~known][0]
        raise InputError(
            causal_path, f"lacks {split} sample {sample} of {path}", "regenerate both from the same config"
        )
    shown = test[causal[keys].to_numpy()]
    metrics: dict[str, dict[str, float]] = {"causal_samples": {ALL: len(shown)}}
    if len(shown):
        metrics["causal_accuracy"] = {ALL: accuracy(*_judged(shown))}
    return metrics


def _judged(rows: pd.DataFrame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return tuple(rows[name].to_numpy() for name in ("concept_true", "concept_predicted", "abstained"))


def _samples(rows: pd.DataFrame) -> pd.MultiIndex:
    import pandas as pd

    return pd.MultiIndex.from_frame(rows[["split", "sample"]])


def collect_timings(timing_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return mean `seconds_per_sample` and `icp_seconds_per_sample`, tidy as :func:`collect`, with table "runtime".

    Means are over the test rows, as in :func:`collect`. Apart from the metrics, because times differ from run to run
    and metrics must not.
    """
    records = []
    for path in timing_files:
        source, method, seed = source_method_seed(path)
        rows = read_csv(path, TIMING_COLUMNS)
        test = rows[rows["split"] == "test"]
        if test.empty:
            raise InputError(path, "has no test rows", "regenerate it")
        for column in ("seconds", "icp_seconds"):
            mean = float(numbers(path, test, column).mean())
            records.append(("runtime", source, method, f"{column}_per_sample", ALL, seed, mean))
    return tidy(records, "timings")
