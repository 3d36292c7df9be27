"""Table V's learners under other readings: the kernel, the linear SVM, the encoder's head; and classic features."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import softmax

from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, train_encoder
from gpca.experiments.specification_curve.diagnostics import accuracies, table5
from gpca.experiments.specification_curve.run_files import Row, RunFiles
from gpca.experiments.specification_curve.settings import Reading, ReadingSizes
from gpca.explainers.analytical_features import analytical_features
from gpca.explainers.classifiers import PAPERS_RANDOM_STATE
from gpca.explainers.registry import explainer_entry
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS

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
        train, test = (registrations.subset(registrations.rows(split)) for split in ("train", "test"))
        distance_S = sets.distance[sets.rows("in_distribution", "test"), 0]
        for name in dict.fromkeys(reading["kernel"] for reading in readings):
            of_kernel = {reading["iterations"]: reading for reading in readings if reading["kernel"] == name}
            settings = GPCSettings(**{**run_files.section(GPC_OF_TABLE_V), "kernel": name})
            gpc = GPC(CONCEPTS, settings, source, seed)
            for iterations in gpc.fit_up_to(of_kernel, train.embedding, train.concept):
                scores_S_C, _, _ = gpc.attribute(test.embedding)
                for (metric, concept), value in table5(test.concept, scores_S_C, distance_S).items():
                    yield of_kernel[iterations], source, GPC_OF_TABLE_V, metric, concept, seed, value


def linear_svm(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the linear SVM's numbers of Table V, by its kind."""
    for source, seed, sets, registrations in run_files.in_distribution():
        distance_S = sets.distance[sets.rows("in_distribution", "test"), 0]
        train, test = (registrations.subset(registrations.rows(split)) for split in ("train", "test"))
        for reading in readings:
            scores_S_C = svm_scores(train, test.embedding, **reading)
            for (metric, concept), value in table5(test.concept, scores_S_C, distance_S).items():
                yield reading, source, SVM, metric, concept, seed, value


def svm_scores(train: Registrations, asked_S_d: np.ndarray, machine: str, inputs: str, probability: str) -> np.ndarray:
    """Fit a linear SVM to embeddings and return its scores (S, C) at others."""
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
        return fitted.predict_proba(np.asarray(asked_S_d, float))[:, columns]
    return softmax(fitted.decision_function(np.asarray(asked_S_d, float))[:, columns], axis=1)


def encoder_head(run_files: RunFiles, readings: Sequence[Reading], sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of Table V's learners on embeddings by encoders that were trained with other heads."""
    for number, (source, seed, _, registrations) in enumerate(run_files.in_distribution()):
        of_heads = {"linear": registrations}
        if number < sizes.encoders:
            clouds = Registrations.load(run_files.registrations[source, seed], (source, seed))
            settings = EncoderSettings(**{**run_files.section("encoder"), "head": "two_layer"})
            model, _ = train_encoder(clouds, source, seed, settings)
            h_S_d, _ = embed(model, clouds, source, seed, settings)
            of_heads["two_layer"] = replace(clouds, attached={"embedding": h_S_d})
        for head, embedded in of_heads.items():
            train, test = (embedded.subset(embedded.rows(split)) for split in ("train", "test"))
            of_head = {}
            for name in ("gpca_paper", GPC_OF_TABLE_V):  # the first is that of Tables I and II
                gpc = GPC(CONCEPTS, GPCSettings(**run_files.section(name)), source, seed)
                of_head[name] = gpc.fit(train.embedding, train.concept).attribute(test.embedding)[0]
            trees = explainer_entry(FOREST).make(source, seed)
            trees.fit(train)
            of_head[FOREST] = trees.explain(test).scores_N_C
            for reading in (reading for reading in readings if reading["head"] == head):
                svm_S_C = svm_scores(train, test.embedding, "svc", reading["inputs"], "platt")
                for method, scores_S_C in {**of_head, SVM: svm_S_C}.items():
                    for (metric, concept), value in accuracies(test.concept, scores_S_C).items():
                        yield reading, source, method, metric, concept, seed, value


def classic_features(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of the paper's GPC on each choice of features."""
    for (source, seed), path in run_files.registrations.items():
        registrations = Registrations.load(path, (source, seed))
        features_S_F = analytical_features(registrations, source, seed, "analytical")
        train, test = (registrations.rows(split) for split in ("train", "test"))
        for reading in readings:
            chosen_S_F = features_S_F[:, FEATURES[reading["features"]]]
            gpc = GPC(CONCEPTS, GPCSettings(**run_files.section("gpca_paper")), source, seed)
            gpc.fit(chosen_S_F[train], registrations.concept[train])
            scores_S_C, _, _ = gpc.attribute(chosen_S_F[test])
            for (metric, concept), value in accuracies(registrations.concept[test], scores_S_C).items():
                yield reading, source, "analytical_gpc", metric, concept, seed, value
