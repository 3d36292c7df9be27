"""Table V's learners under other readings: kernel, linear SVM, encoder head, diagnostics; and classic features."""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace

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
from gpca.io.frame import Frame
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.steps.readings.files import Row, RunFiles, Values, accuracies, table5, train_and_test
from gpca.steps.readings.gpc_start import gpc_scores
from gpca.steps.readings.groups import Reading

GPC_OF_TABLE_V, FOREST, SVM = "gpca_matern", "learner_forest", "learner_linear_svm"
# Columns of the features: the residual first, the ratio of the point counts last.
FEATURES = {
    "all": slice(None),
    "no_counts": slice(None, -1),
    "no_residual": slice(1, None),
    "residual": slice(0, 1),
    "counts": slice(-1, None),
}


def kernel(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """The GPC's numbers of Table V, by its kernel and schedule."""
    for source, seed, registrations, distance_S in run_files.in_distribution():
        train, test = train_and_test(registrations)
        for name in dict.fromkeys(reading["kernel"] for reading in readings):
            by_iterations = {reading["iterations"]: reading for reading in readings if reading["kernel"] == name}
            settings = GPCSettings(**run_files.section(GPC_OF_TABLE_V) | {"kernel": name})
            gpc = GPC(CONCEPTS, settings, source, seed)
            for iterations in gpc.fit_up_to(by_iterations, train.embedding, train.concept):
                values = table5(test.concept, gpc.attribute(test.embedding)[0], distance_S)
                yield by_iterations[iterations], source, GPC_OF_TABLE_V, seed, values


def linear_svm(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """The linear SVM's numbers of Table V, by its kind."""
    for source, seed, registrations, distance_S in run_files.in_distribution():
        train, test = train_and_test(registrations)
        for reading in readings:
            scores_S_C = svm_scores(train, test.embedding, **reading)
            yield reading, source, SVM, seed, table5(test.concept, scores_S_C, distance_S)


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
    columns, h_S_d = [list(fitted.classes_).index(concept) for concept in CONCEPTS], np.asarray(h_S_d, float)
    if probability == "platt":
        return fitted.predict_proba(h_S_d)[:, columns]
    return softmax(fitted.decision_function(h_S_d)[:, columns], axis=1)


def encoder_head(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """Accuracies of Table V's learners on embeddings by encoders that were trained with other heads."""
    for number, (source, seed, registrations, _) in enumerate(run_files.in_distribution()):
        by_head = {"linear": registrations}
        if number < run_files.sizes.encoders:
            clouds = Registrations.load(run_files.registrations[source, seed], (source, seed))
            settings = EncoderSettings(**run_files.section("encoder") | {"head": "two_layer"})
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
                scores[SVM] = svm_scores(train, test.embedding, "svc", reading["inputs"], "platt")
                for method, scores_S_C in scores.items():
                    yield reading, source, method, seed, accuracies(test.concept, scores_S_C)


def classic_features(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """Accuracies of the paper's GPC on each choice of features."""
    for source, seed, registrations in run_files.loaded():
        features_S_F = analytical_features(registrations, source, seed, "analytical")
        for reading in readings:
            chosen = replace(registrations, attached={"embedding": features_S_F[:, FEATURES[reading["features"]]]})
            train, test = train_and_test(chosen)
            scores_S_C = gpc_scores(run_files.section("gpca_paper"), train, test.embedding, source, seed)
            yield reading, source, "analytical_gpc", seed, accuracies(test.concept, scores_S_C)


def diagnostics(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """ρ, AUC and ECE of each learner under each reading."""
    learned = read_learner_predictions(run_files.predictions.values(), run_files.sets.values())
    for (source, learner, seed), rows in learned.items():
        by_set = sets_of(rows)
        for reading in readings:
            if (in_set := by_set.get(reading["set"])) is not None:
                yield reading, source, learner, seed, diagnostics_under(in_set, reading)


def diagnostics_under(rows: Frame, reading: Reading) -> Values:
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
