"""Turns diagnoses into metrics of every source, explainer and seed, in one tidy table."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.metrics import ABSTAINED, ALL, PREDICTED_AS, confusion, tidy
from gpca.causes.dataset import LABELS
from gpca.causes.truth import BORDERLINE
from gpca.experiments.diagnosis.judged import POOLED, Judged, joined, read_judged
from gpca.experiments.diagnosis.measures import measure

if TYPE_CHECKING:
    import pandas as pd

TABLE = "causes"


def collect(prediction_files: Iterable[str | Path], causes_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return tidy metrics of all test samples of a seed: the confusion, and what `measures` measures.

    Raises:
        InputError: see :func:`gpca.experiments.diagnosis.judged.read_judged`.
    """
    records = []
    for (source, explainer, seed), samples in with_pooled(read_judged(prediction_files, causes_files)).items():
        one_1_N = np.ones((1, len(samples)))
        found = {metric: value_1[0] for metric, value_1 in measure(samples, one_1_N).items()}
        found["test_samples"] = len(samples)
        records += [
            (TABLE, source, explainer, metric, ALL, seed, float(value))
            for metric, value in found.items()
            if np.isfinite(value)
        ]
        records += [(TABLE, source, explainer, *row[:2], seed, row[2]) for row in _confusion(samples)]
    return tidy(records, "diagnoses")


def with_pooled(judged: dict[tuple[str, str, int], Judged]) -> dict[tuple[str, str, int], Judged]:
    """Return the same with all sources together besides, where there are several."""
    sources = list(dict.fromkeys(source for source, _, _ in judged))
    if len(sources) < 2:
        return judged
    rest = list(dict.fromkeys((explainer, seed) for _, explainer, seed in judged))
    return judged | {
        (POOLED, explainer, seed): joined(judged[source, explainer, seed] for source in sources)
        for explainer, seed in rest
        if all((source, explainer, seed) in judged for source in sources)
    }


def _confusion(samples: Judged) -> list[tuple[str, str, float]]:
    """Return (metric, true label, count) of every label that is taken for another, borderline left out."""
    if not samples.names_causes:
        return []
    shown = samples.label != BORDERLINE
    none_named = samples.named == ""
    counts = confusion(samples.label[shown], samples.named[shown], none_named[shown], LABELS)
    return [
        (PREDICTED_AS + predicted, true, float(count))
        for true, row in zip(LABELS, counts, strict=True)
        for predicted, count in zip((*LABELS, ABSTAINED), row, strict=True)
        if row.sum()
    ]
