"""Diagnostics of learners on samples like and unlike the training, with intervals over families of objects."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution import weighted
from gpca.evaluation.intervals import Clustered, Estimate
from gpca.evaluation.measures import ALL, intervals
from gpca.experiments.out_of_distribution.metrics import (
    TABLE,
    probabilities,
    read_learner_predictions,
    sets_of,
    wrong,
)
from gpca.experiments.out_of_distribution.sets import DISTANCES

if TYPE_CHECKING:
    import pandas as pd

RHO = f"rho_max_score_{DISTANCES[0]}"
AREAS = {"aurc": weighted.aurc, "excess_aurc": weighted.excess_aurc, "augrc": weighted.augrc}
LEAST_PROBABILITY = 1e-12  # of a true class, as in gpca.attribution.diagnostics


def collect_intervals(prediction_files: Iterable[str | Path], set_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the diagnostics of Table V over all seeds, with 95 % intervals (:mod:`gpca.evaluation.measures`).

    Of every set: accuracy, ece, nll, brier and the areas by the largest score. Of it, and of every shifted set together
    with the samples like the training's: the rank correlation of the largest score with the distance. Means are over
    samples; areas, ece and correlation are those of each seed. The draws of a set are the same for all learners.

    Raises:
        InputError: see :func:`gpca.experiments.out_of_distribution.metrics.read_learner_predictions`; no files.
    """
    import pandas as pd

    parts: dict[tuple[str, str], list[pd.DataFrame]] = {}
    for (source, learner, seed), rows in read_learner_predictions(prediction_files, set_files).items():
        parts.setdefault((source, learner), []).append(rows.assign(seed=seed))
    records = []
    for (source, learner), of_seeds in parts.items():
        for name, of_set in sets_of(pd.concat(of_seeds, ignore_index=True)).items():
            samples = Clustered.drawn(of_set["seed"], clusters_of(of_set), "learner intervals", source, name)
            estimates = {RHO: _correlation(of_set, samples)}
            if "+" not in name:
                estimates |= estimates_of_scores(of_set, samples) | _areas(of_set, samples)
            records += [
                samples.record((TABLE + name, source, learner, metric, ALL), estimate)
                for metric, estimate in estimates.items()
            ]
    return intervals(records, "learners")


def estimates_of_scores(rows: pd.DataFrame, samples: Clustered) -> dict[str, Estimate]:
    """Return accuracy, mean confidence, ece, nll and Brier score of the rows of predictions that the samples are."""
    p_S_C, target_S = probabilities(rows)

    def calibration_error(of: np.ndarray, weights_B_n: np.ndarray) -> np.ndarray:
        return weighted.calibration_error(p_S_C[of], target_S[of], weights_B_n)

    p_true_S = np.maximum(p_S_C[np.arange(len(target_S)), target_S], LEAST_PROBABILITY)
    squares_S = np.square(p_S_C - np.eye(p_S_C.shape[1])[target_S]).sum(axis=1)
    return {
        "accuracy": samples.share(~wrong(rows)),
        "confidence": samples.mean(p_S_C.max(axis=1), (0, 1)),
        "ece": samples.over_seeds(calibration_error, (0, 1)),
        "nll": samples.mean(-np.log(p_true_S), (0, np.inf)),
        "brier": samples.mean(squares_S, (0, 2)),
    }


def _areas(rows: pd.DataFrame, samples: Clustered) -> dict[str, Estimate]:
    confidence_S, wrong_S = -rows["max_score"].to_numpy(), wrong(rows)

    def area(function, of: np.ndarray, weights_B_n: np.ndarray) -> np.ndarray:
        return function(confidence_S[of], wrong_S[of], weights_B_n)

    return {
        f"{name}_max_score": samples.over_seeds(partial(area, function), (0, 1)) for name, function in AREAS.items()
    }


def _correlation(rows: pd.DataFrame, samples: Clustered) -> Estimate:
    score_S, distance_S = (rows[name].to_numpy(float) for name in ("max_score", DISTANCES[0]))
    return samples.over_seeds(
        lambda of, weights: weighted.rank_correlation(score_S[of], distance_S[of], weights), (-1, 1)
    )


def clusters_of(rows: pd.DataFrame) -> list[str]:
    """Return what each sample is alike with: its family, which is another one in the other source's set."""
    is_other = rows["set"] == "source"
    return [f"{'other/' * other}{name}" for other, name in zip(is_other, rows["cluster"], strict=True)]
