"""Accuracies of explainers over all seeds, with intervals over families of objects."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import permutations
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.metrics import read_causal
from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.errors import InputError
from gpca.evaluation.intervals import Clustered, Estimate
from gpca.evaluation.measures import ALL, intervals, source_method_seed

if TYPE_CHECKING:
    import pandas as pd

TABLE = "attribution"


def collect_intervals(prediction_files: Iterable[str | Path], causal_files: Iterable[str | Path] = ()) -> pd.DataFrame:
    """Return accuracies of `metrics.csv` over all seeds, with 95 % intervals (:mod:`gpca.evaluation.measures`).

    - accuracy: of all test samples and of each concept; an abstained sample is wrong.
    - permuted_accuracy: mean over the seeds of each one's accuracy under its best renaming of the concepts.
    - causal_accuracy: of the causal samples, where there are causal files.

    The draws of a source are the same for all explainers that explain the same samples.

    Args:
        prediction_files: named `…/{source}/{explainer}/seed{seed}.csv`.
        causal_files: named `…/{source}/{design}/seed{seed}.csv`.

    Raises:
        InputError: no files, a name of another form, a file that cannot be read or has no test rows, a sample that the
            causal file of its source and seed lacks.
    """
    import pandas as pd

    causal = {source_method_seed(path)[::2]: path for path in causal_files}
    parts: dict[tuple[str, str], list[pd.DataFrame]] = {}
    for path in prediction_files:
        source, method, seed = source_method_seed(path)
        rows = read_predictions(path)
        rows = rows[rows["split"] == "test"].assign(seed=seed)
        if rows.empty:
            raise InputError(path, "has no test rows", "regenerate it")
        if (source, seed) in causal:
            rows["causal"] = _causal(path, rows, causal[source, seed])
        parts.setdefault((source, method), []).append(rows)
    records = []
    for (source, method), of_seeds in parts.items():
        rows = pd.concat(of_seeds, ignore_index=True)
        samples = Clustered.drawn(rows["seed"], rows["cluster"], "attribution intervals", source)
        for metric, concept, own, estimate in _estimates(rows, samples):
            records.append(own.record((TABLE, source, method, metric, concept), estimate))
    return intervals(records, "predictions")


def _causal(path: str | Path, rows: pd.DataFrame, causal_path: str | Path) -> np.ndarray:
    """Return whether each row is of a causal sample."""
    import pandas as pd

    causal = read_causal(causal_path)
    keys = pd.MultiIndex.from_frame(rows[["split", "sample"]])
    if not keys.isin(causal.index).all():
        raise InputError(causal_path, f"lacks samples of {path}", "regenerate both from the same config")
    return causal[keys].to_numpy(bool)


def _estimates(rows: pd.DataFrame, samples: Clustered) -> list[tuple[str, str, Clustered, Estimate]]:
    """Return metric, concept, the samples that it is over, and the estimate of each."""
    concepts = concepts_of(rows)
    true_N, named_N = (rows[name].to_numpy(str) for name in ("concept_true", "concept_predicted"))
    named_N = np.where(rows["abstained"], "", named_N)
    right_N = true_N == named_N
    of_true_C_N, of_named_C_N = (np.array([of == concept for concept in concepts]) for of in (true_N, named_N))

    def permuted(of: np.ndarray, weights_B_n: np.ndarray) -> np.ndarray:
        hits_C_C_n = of_true_C_N[:, None, of] & of_named_C_N[None, :, of]
        renamings = [
            hits_C_C_n[range(len(concepts)), list(order)].any(axis=0) for order in permutations(range(len(concepts)))
        ]
        best_B = np.max([(weights_B_n * hit_n).sum(axis=1) for hit_n in renamings], axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):  # a draw without any sample has no value
            return best_B / weights_B_n.sum(axis=1)

    estimates = [("accuracy", ALL, samples, samples.share(right_N))]
    for concept, of_concept_N in zip(concepts, of_true_C_N, strict=True):
        if of_concept_N.any():
            own = samples.subset(of_concept_N)
            estimates.append(("accuracy", concept, own, own.share(right_N[of_concept_N])))
    estimates.append(("permuted_accuracy", ALL, samples, samples.over_seeds(permuted, (0, 1))))
    if "causal" in rows and (causal_N := rows["causal"].eq(True).to_numpy()).any():
        own = samples.subset(causal_N)
        estimates.append(("causal_accuracy", ALL, own, own.share(right_N[causal_N])))
    return estimates
