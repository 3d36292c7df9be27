"""Table V's learners under other readings: kernel, linear SVM, encoder head, diagnostics; and classic features."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import softmax

from gpca.attribution.diagnostics import aurc, calibration_error, rank_correlation
from gpca.attribution.learner_predictions import probabilities, read_learner_predictions, sets_of, wrong
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, train_encoder
from gpca.evaluation.measures import ALL
from gpca.explainers.analytical_features import analytical_features
from gpca.explainers.classifiers import PAPERS_RANDOM_STATE
from gpca.explainers.registry import explainer_entry
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.steps.readings.files import Row, RunFiles, Values, accuracies, rows_of, table5, train_and_test
from gpca.steps.readings.gpc_start import gpc_scores
from gpca.steps.readings.groups import Reading, ReadingSizes

if TYPE_CHECKING:
    import pandas as pd

GPC_OF_TABLE_V, FOREST, SVM = "gpca_matern", "learner_forest", "learner_linear_svm"
# Columns of the features: the residual first, the ratio of the point counts last.
FEATURES = {
    "all": slice(None),
    "no_counts": slice(None, -1),
    "no_residual": slice(1, None),
    "residual": slice(0, 1),
    "counts": slice(-1, None),
}


def kernel(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the GPC's numbers of Table V, by its kernel and schedule."""
    for source, seed, sets, registrations in run_files.in_distribution():
        train, test = train_and_test(registrations)
        distance_S = sets.distance[sets.rows("in_distribution", "test"), 0]
        for name in dict.fromkeys(reading["kernel"] for reading in readings):
            by_iterations = {reading["iterations"]: reading for reading in readings if reading["kernel"] == name}
            settings = GPCSettings(**{**run_files.section(GPC_OF_TABLE_V), "kernel": name})
            gpc = GPC(CONCEPTS, settings, source, seed)
            for iterations in gpc.fit_up_to(by_iterations, train.embedding, train.concept):
                values = table5(test.concept, gpc.attribute(test.embedding)[0], distance_S)
                yield from rows_of(values, by_iterations[iterations], source, GPC_OF_TABLE_V, seed)


def linear_svm(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the linear SVM's numbers of Table V, by its kind."""
    for source, seed, sets, registrations in run_files.in_distribution():
        train, test = train_and_test(registrations)
        distance_S = sets.distance[sets.rows("in_distribution", "test"), 0]
        for reading in readings:
            scores_S_C = svm_scores(train, test.embedding, **reading)
            yield from rows_of(table5(test.concept, scores_S_C, distance_S), reading, source, SVM, seed)


def svm_scores(train: Registrations, h_S_d: np.ndarray, machine: str, inputs: str, probability: str) -> np.ndarray:
    """Scores (S, C) at embeddings by a linear SVM that is fitted to training samples."""
    from sklearn.calibration import CalibratedClassifierCV
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import FunctionTransformer, StandardScaler
    from sklearn.svm import SVC, LinearSVC

    svm = {
        "svc": SVC(kernel="linear", random_state=PAPERS_RANDOM_STATE),
        "linear_svc": LinearSVC(random_state=PAPERS_RANDOM_STATE),
    }[machine]
    if probability == "platt":
        folds = min(5, *np.unique(train.concept, return_counts=True)[1])
        svm = CalibratedClassifierCV(svm, cv=folds, ensemble=False)
    scaling = StandardScaler() if inputs == "standardised" else FunctionTransformer()
    fitted = make_pipeline(scaling, svm)
    with warnings.catch_warnings():  # scikit-learn's defaults stop before a LinearSVC on raw inputs has converged
        warnings.simplefilter("ignore")
        fitted.fit(np.asarray(train.embedding, float), train.concept)
    columns = [list(fitted.classes_).index(concept) for concept in CONCEPTS]
    if probability == "platt":
        return fitted.predict_proba(np.asarray(h_S_d, float))[:, columns]
    return softmax(fitted.decision_function(np.asarray(h_S_d, float))[:, columns], axis=1)


def encoder_head(run_files: RunFiles, readings: Sequence[Reading], sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of Table V's learners on embeddings by encoders that were trained with other heads."""
    for number, (source, seed, _, registrations) in enumerate(run_files.in_distribution()):
        by_head = {"linear": registrations}
        if number < sizes.encoders:
            clouds = Registrations.load(run_files.registrations[source, seed], (source, seed))
            settings = EncoderSettings(**{**run_files.section("encoder"), "head": "two_layer"})
            model, _ = train_encoder(clouds, source, seed, settings)
            h_S_d, _ = embed(model, clouds, source, seed, settings)
            by_head["two_layer"] = replace(clouds, attached={"embedding": h_S_d})
        for head, embedded in by_head.items():
            train, test = train_and_test(embedded)
            scores = {  # the first is that of Tables I and II
                name: gpc_scores(run_files.section(name), train, test.embedding, source, seed)
                for name in ("gpca_paper", GPC_OF_TABLE_V)
            }
            trees = explainer_entry(FOREST).make(source, seed)
            trees.fit(train)
            scores[FOREST] = trees.explain(test).scores_N_C
            for reading in (reading for reading in readings if reading["head"] == head):
                svm_S_C = svm_scores(train, test.embedding, "svc", reading["inputs"], "platt")
                for method, scores_S_C in {**scores, SVM: svm_S_C}.items():
                    yield from rows_of(accuracies(test.concept, scores_S_C), reading, source, method, seed)


def classic_features(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of the paper's GPC on each choice of features."""
    for (source, seed), path in run_files.registrations.items():
        registrations = Registrations.load(path, (source, seed))
        features_S_F = analytical_features(registrations, source, seed, "analytical")
        for reading in readings:
            chosen = replace(registrations, attached={"embedding": features_S_F[:, FEATURES[reading["features"]]]})
            train, test = train_and_test(chosen)
            scores_S_C = gpc_scores(run_files.section("gpca_paper"), train, test.embedding, source, seed)
            yield from rows_of(accuracies(test.concept, scores_S_C), reading, source, "analytical_gpc", seed)


def diagnostics(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield ρ, AUC and ECE of each learner under each reading."""
    learned = read_learner_predictions(run_files.predictions.values(), run_files.sets.values())
    for (source, learner, seed), rows in learned.items():
        by_set = sets_of(rows)
        for reading in readings:
            if (in_set := by_set.get(reading["set"])) is not None:
                yield from rows_of(diagnostics_under(in_set, reading), reading, source, learner, seed)


def diagnostics_under(rows: pd.DataFrame, reading: Reading) -> Values:
    """ρ, the area and ECE of one learner, by the names of their counterparts; entropy stands for BALD.

    Without any error, or with errors alone, there is no ROC curve, and no value of it.
    """
    score_S = rows[reading["score"] if reading["score"] in rows else "entropy"].to_numpy(float)
    wrong_S = wrong(rows)
    values = {
        "rho_max_score_knn_analytical": rank_correlation(score_S, rows[reading["distance"]].to_numpy(float)),
        "ece": calibration_error(*probabilities(rows)),
    }
    if reading["area"] == "aurc":
        values["aurc_max_score"] = aurc(-score_S, wrong_S)
    elif 0 < wrong_S.sum() < len(wrong_S):
        from sklearn.metrics import roc_auc_score

        values["aurc_max_score"] = 1 - float(roc_auc_score(wrong_S, score_S))
    return {(name, ALL): float(np.asarray(value)) for name, value in values.items()}
