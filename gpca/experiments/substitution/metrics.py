"""Turns predictions with something else beneath the explainers into one tidy table of metrics."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.attribution.metrics import ALL, source_method_seed, tidy
from gpca.attribution.predictions import read_predictions
from gpca.errors import InputError
from gpca.experiments.substitution.settings import ESTIMATOR, FAILURE, LABELS, METHOD

if TYPE_CHECKING:
    import pandas as pd

MONTE_CARLO = "monte_carlo"  # whose explanations the others are compared with
ANOTHER = "another"  # all methods but the one that was learned from


def collect(prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return tidy metrics of files named ``…/{source}/seed{seed}.csv``; ``table`` is the explainer.

    Of an explainer that reads an uncertainty, ``method`` is the estimator and ``concept`` a concept, or all:

    - accuracy: share that is named rightly; without an estimate nothing is.
    - no_estimate: share without one.
    - abstained: share of which no concept is named although there is one.
    - agreement: share of which the same is said as with Monte-Carlo, where that is among the estimators.

    Of another, ``method`` is that of the test registrations, or `ANOTHER`, and ``concept`` that which it learned from:

    - accuracy.
    - failed: share of registrations that failed; they are explained as the others are.

    Both have test_samples.

    Raises:
        InputError: no files, one that cannot be read, or that exchanges something else.
    """
    records = []
    for path in prediction_files:
        _, source, seed = source_method_seed(path)
        rows = read_predictions(path, (*LABELS, FAILURE))
        if unknown := sorted(set(rows["exchanged"]) - {METHOD, ESTIMATOR}):
            raise InputError(path, f"exchanges '{unknown[0]}'", f"expected {METHOD} or {ESTIMATOR}")
        rows["right"] = (rows["concept_true"] == rows["concept_predicted"]) & ~rows["abstained"]
        for (exchanged, explainer), of_explainer in rows.groupby(["exchanged", "explainer"], sort=False):
            measure = _of_estimators if exchanged == ESTIMATOR else _of_methods
            records += [
                (explainer, source, beneath, metric, concept, seed, float(value))
                for beneath, concept, metrics in measure(of_explainer)
                for metric, value in metrics.items()
            ]
    return tidy(records, "exchange")


def _of_estimators(rows: pd.DataFrame) -> Iterator[tuple[str, str, dict[str, float]]]:
    named_by = rows.set_index(["asked_of", "split", "sample"])["concept_predicted"]
    usual = named_by.loc[MONTE_CARLO] if MONTE_CARLO in set(rows["asked_of"]) else None
    for estimator, of_estimator in rows.groupby("asked_of", sort=False):
        for concept in (ALL, *of_estimator["concept_true"].unique()):
            chosen = of_estimator if concept == ALL else of_estimator[of_estimator["concept_true"] == concept]
            metrics = {"accuracy": chosen["right"].mean(), "test_samples": len(chosen)}
            if concept == ALL:
                untold = chosen[FAILURE] != ""
                metrics |= {"no_estimate": untold.mean(), "abstained": (chosen["abstained"] & ~untold).mean()}
                if usual is not None:
                    own = named_by.loc[estimator]
                    metrics["agreement"] = (own == usual.reindex(own.index)).mean()
            yield estimator, concept, metrics


def _of_methods(rows: pd.DataFrame) -> Iterator[tuple[str, str, dict[str, float]]]:
    for learnt_from, of_lesson in rows.groupby("learnt_from", sort=False):
        parts = dict(iter(of_lesson.groupby("asked_of", sort=False)))
        if len(parts) > 1:
            parts[ANOTHER] = of_lesson[of_lesson["asked_of"] != learnt_from]
        for asked_of, part in parts.items():
            failed = (part[FAILURE] != "").mean()
            yield asked_of, learnt_from, {"accuracy": part["right"].mean(), "failed": failed, "test_samples": len(part)}
