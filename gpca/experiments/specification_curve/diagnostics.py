"""Values of the printed numbers that readings touch: accuracies, and Table V's ρ, AUC and ECE on any samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.diagnostics import aurc, calibration_error, rank_correlation
from gpca.attribution.learner_predictions import probabilities, read_learner_predictions, sets_of, wrong
from gpca.attribution.metrics import accuracy, concept_accuracy
from gpca.evaluation.measures import ALL
from gpca.experiments.specification_curve.run_files import Row, RunFiles
from gpca.experiments.specification_curve.settings import Reading, ReadingSizes
from gpca.pairs.perturbation import CONCEPTS

if TYPE_CHECKING:
    import pandas as pd

Values = dict[tuple[str, str], float]  # (metric, concept) -> value, named as in published.csv


def run(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield ρ, AUC and ECE of each learner under each reading."""
    learned = read_learner_predictions(run_files.predictions.values(), run_files.sets.values())
    for (source, learner, seed), rows in learned.items():
        of_sets = sets_of(rows)
        for reading in readings:
            if (of_set := of_sets.get(reading["set"])) is None:
                continue
            for metric, value in diagnostics(of_set, reading).items():
                yield reading, source, learner, metric, ALL, seed, value


def diagnostics(rows: pd.DataFrame, reading: Reading) -> dict[str, float]:
    """Return ρ, the area and ECE of one learner, by the names of their counterparts; entropy stands for BALD.

    Without any error, or with errors alone, there is no ROC curve, and no value of it.
    """
    score_S = rows[reading["score"] if reading["score"] in rows else "entropy"].to_numpy(float)
    values = {
        "rho_max_score_knn_analytical": rank_correlation(score_S, rows[reading["distance"]].to_numpy(float)),
        "ece": calibration_error(*probabilities(rows)),
    }
    wrong_S = wrong(rows)
    if reading["area"] == "aurc":
        values["aurc_max_score"] = aurc(-score_S, wrong_S)
    elif 0 < wrong_S.sum() < len(wrong_S):
        from sklearn.metrics import roc_auc_score

        values["aurc_max_score"] = 1 - float(roc_auc_score(wrong_S, score_S))
    return {name: float(np.asarray(value)) for name, value in values.items()}


def accuracies(true_S: np.ndarray, scores_S_C: np.ndarray) -> Values:
    """Return the accuracy over all samples, and over those of each concept."""
    named_S = np.array(CONCEPTS)[scores_S_C.argmax(axis=1)]
    return accuracies_of_named(true_S, named_S)


def accuracies_of_named(true_S: np.ndarray, named_S: np.ndarray) -> Values:
    """Return the same from the concepts that were named."""
    none_S = np.zeros(len(true_S), bool)
    of_concepts = concept_accuracy(true_S, named_S, none_S, CONCEPTS)
    return {("accuracy", c): v for c, v in ({ALL: accuracy(true_S, named_S, none_S)} | of_concepts).items()}


def table5(true_S: np.ndarray, scores_S_C: np.ndarray, distance_S: np.ndarray) -> Values:
    """Return the accuracies, and Table V's diagnostics of the uncertainty 1 - max ŝ: ρ, AUC and ECE."""
    target_S = np.array([CONCEPTS.index(concept) for concept in true_S])
    confidence_S = scores_S_C.max(axis=1)
    return accuracies(true_S, scores_S_C) | {
        ("rho_max_score_knn_analytical", ALL): rank_correlation(1 - confidence_S, distance_S),
        ("aurc_max_score", ALL): aurc(confidence_S, scores_S_C.argmax(axis=1) != target_S),
        ("ece", ALL): calibration_error(scores_S_C, target_S),
    }
