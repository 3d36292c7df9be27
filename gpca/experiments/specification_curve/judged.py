"""Turns the predictions under a reading into values of the printed numbers that it touches."""

from __future__ import annotations

import numpy as np

from gpca.attribution.diagnostics import aurc, calibration_error, rank_correlation
from gpca.attribution.metrics import ALL, accuracy, concept_accuracy
from gpca.pairs.perturbation import CONCEPTS

Values = dict[tuple[str, str], float]  # (metric, concept) -> value, named as in published.csv


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
