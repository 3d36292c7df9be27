"""Turns predictions with something else beneath the explainers into tidy metrics, and into intervals of these."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from gpca.attribution.predictions import read_predictions
from gpca.errors import InputError
from gpca.evaluation.intervals import Clustered
from gpca.evaluation.measures import ALL, POOLED, intervals, source_method_seed, tidy
from gpca.experiments.substitution.settings import ESTIMATOR, FAILURE, LABELS, METHOD

if TYPE_CHECKING:
    import pandas as pd

MONTE_CARLO = "monte_carlo"  # whose explanations the others are compared with
ANOTHER = "another"  # all methods but the one that was learned from


class Answers(NamedTuple):
    """The answers of an explainer with one method or estimator beneath it.

    Attributes:
        explainer, beneath, concept: as `table`, `method` and `concept` of the metrics.
        rows: of the samples.
        are: metric -> whether it counts each of them.
    """

    explainer: str
    beneath: str
    concept: str
    rows: pd.DataFrame
    are: dict[str, pd.Series]


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
    for (source, seed), rows in _read(prediction_files).groupby(["source", "seed"], sort=False):
        for explainer, beneath, concept, chosen, are in _answers(rows):
            values = {metric: share_S.mean() for metric, share_S in are.items()} | {"test_samples": len(chosen)}
            records += [
                (explainer, source, beneath, metric, concept, seed, float(value)) for metric, value in values.items()
            ]
    return tidy(records, "exchange")


def collect_intervals(prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the same shares over all sources and seeds, with 95 % intervals (:mod:`gpca.evaluation.measures`).

    A cluster is a family of objects of one source, and has the same draws in all rows.
    """
    rows = _read(prediction_files)
    samples = Clustered.drawn(rows["seed"], rows["source"] + "/" + rows["cluster"], "exchange intervals")
    records = []
    for explainer, beneath, concept, chosen, are in _answers(rows):
        own = samples.subset(chosen.index.to_numpy())
        for metric, is_S in are.items():
            records.append(own.record((explainer, POOLED, beneath, metric, concept), own.share(is_S.to_numpy())))
    return intervals(records, "exchange")


def _read(prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the rows of all files, with their source and seed and whether they are right."""
    import pandas as pd

    frames = []
    for path in prediction_files:
        _, source, seed = source_method_seed(path)
        rows = read_predictions(path, (*LABELS, FAILURE))
        if unknown := sorted(set(rows["exchanged"]) - {METHOD, ESTIMATOR}):
            raise InputError(path, f"exchanges '{unknown[0]}'", f"expected {METHOD} or {ESTIMATOR}")
        right_S = (rows["concept_true"] == rows["concept_predicted"]) & ~rows["abstained"]
        frames.append(rows.assign(source=source, seed=seed, right=right_S))
    if not frames:
        raise InputError("exchange", "no files were given", "name a source in exchange.sources")
    return pd.concat(frames, ignore_index=True)


def _answers(rows: pd.DataFrame) -> Iterator[Answers]:
    for (exchanged, explainer), of_explainer in rows.groupby(["exchanged", "explainer"], sort=False):
        judge = _of_estimators if exchanged == ESTIMATOR else _of_methods
        for beneath, concept, chosen, are in judge(of_explainer):
            yield Answers(str(explainer), beneath, concept, chosen, are)


def _of_estimators(rows: pd.DataFrame) -> Iterator[tuple[str, str, pd.DataFrame, dict[str, pd.Series]]]:
    sample = ["source", "seed", "split", "sample"]
    usual = rows[rows["asked_of"] == MONTE_CARLO].set_index(sample)["concept_predicted"]
    for estimator, of_estimator in rows.groupby("asked_of", sort=False):
        for concept in (ALL, *of_estimator["concept_true"].unique()):
            chosen = of_estimator if concept == ALL else of_estimator[of_estimator["concept_true"] == concept]
            are = {"accuracy": chosen["right"]}
            if concept == ALL:
                untold = chosen[FAILURE] != ""
                are |= {"no_estimate": untold, "abstained": chosen["abstained"] & ~untold}
                if len(usual):
                    own = chosen.set_index(sample)["concept_predicted"]
                    are["agreement"] = own == usual.reindex(own.index)
            yield estimator, concept, chosen, are


def _of_methods(rows: pd.DataFrame) -> Iterator[tuple[str, str, pd.DataFrame, dict[str, pd.Series]]]:
    for learnt_from, of_lesson in rows.groupby("learnt_from", sort=False):
        parts = dict(iter(of_lesson.groupby("asked_of", sort=False)))
        if len(parts) > 1:
            parts[ANOTHER] = of_lesson[of_lesson["asked_of"] != learnt_from]
        for asked_of, part in parts.items():
            yield asked_of, learnt_from, part, {"accuracy": part["right"], "failed": part[FAILURE] != ""}
