"""Learners under other readings: the GPC's start and kernel, the SVM, the encoder's head, diagnostics, features."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import torch
from scipy.special import softmax

from gpca.attribution.diagnostics import aurc, calibration_error, rank_correlation
from gpca.attribution.learner_predictions import probabilities, read_learner_predictions, sets_of, wrong
from gpca.classifier.gpc import GPC
from gpca.classifier.prior import Covariance, Prior, Standardization
from gpca.classifier.settings import GPCSettings
from gpca.classifier.sparse_gp import SparseGPs
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, train_encoder
from gpca.evaluation.measures import ALL
from gpca.explainers.analytical_features import analytical_features
from gpca.explainers.classifiers import PAPERS_RANDOM_STATE
from gpca.explainers.registry import explainer_entry
from gpca.io.frame import Frame
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.seeds import seed_of
from gpca.steps.readings.files import Row, RunFiles, Values, accuracies, table5, train_and_test
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
BATCH = 64  # samples of a minibatch
Schedule = tuple[str, float, int]
# Kernel, rate and iterations of the rows of Table IV whose numbers are missed, and of those that other tables show.
FITTED = (("rbf", 0.001, 200), ("polynomial", 0.001, 200), ("rbf", 0.01, 100), ("matern32", 0.01, 200))
SHOWN_AS = {("rbf", 0.01, 100): "gpca_paper", ("matern32", 0.01, 200): "gpca_matern"}  # in Tables I and II, and in V


@dataclass(frozen=True)
class UnitNorm(Standardization):
    """Inputs of length 1, each scaled by itself."""

    def __call__(self, h_N_d: np.ndarray) -> np.ndarray:
        return to_unit_norm(h_N_d)


class StartedGPC(GPC):
    """The classifier from another start: ``inputs``, ``inducing``, ``lengthscale`` and ``batch`` of a reading."""

    def __init__(self, settings: GPCSettings, reading: Reading, *axes: object) -> None:
        super().__init__(CONCEPTS, settings, *axes)
        self._reading = reading

    def scaling(self, around_R_d: np.ndarray) -> Standardization:
        if self._reading["inputs"] == "standardised":
            return super().scaling(around_R_d)
        unscaled = np.zeros(around_R_d.shape[1]), np.ones(around_R_d.shape[1])
        return (UnitNorm if self._reading["inputs"] == "unit_norm" else Standardization)(*unscaled)

    def start(self, inputs_R_d: torch.Tensor) -> Prior:
        """Inducing inputs at k-means centers or drawn, and the lengthscale."""
        start = super().start(inputs_R_d)
        covariance, inducing_M_d = start.covariance, start.inducing_M_d
        if self._reading["inducing"] == "random":
            random = torch.Generator().manual_seed(seed_of(*self._axes, "random inducing inputs"))
            inducing_M_d = torch.randn((self.settings.inducing, inputs_R_d.shape[1]), generator=random).numpy()
        if self._reading["lengthscale"] == "default":
            covariance = Covariance.start(self.settings.kernel, len(self.classes))
        return Prior(covariance, inducing_M_d)

    def objective(
        self, model: SparseGPs, inputs_N_d: torch.Tensor, targets_N: torch.Tensor, random: torch.Generator
    ) -> torch.Tensor:
        """ELBO of all samples, or its estimate from a minibatch."""
        if self._reading["batch"] == "full":
            return super().objective(model, inputs_N_d, targets_N, random)
        rows = torch.randperm(len(targets_N), generator=random)[:BATCH]
        # The divergence counts once for all samples, not once for each minibatch.
        excess = model.divergence() * (1 / len(rows) - 1 / len(targets_N))
        return model.elbo(inputs_N_d[rows], targets_N[rows]) + excess


def to_unit_norm(h_N_d: np.ndarray) -> np.ndarray:
    """Embeddings (N, d) of length 1; one of length 0 stays as it is."""
    length_N_1 = np.linalg.norm(h_N_d, axis=1, keepdims=True)
    return h_N_d / np.where(length_N_1 > 0, length_N_1, 1)


def starts(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """Accuracies under each reading, and Table V's numbers of those of `SHOWN_AS`."""
    for source, seed, registrations, distance_S in run_files.in_distribution():
        train, test = train_and_test(registrations)
        fitted: dict[tuple, np.ndarray] = {}
        for reading in progress(readings, f"starts of the GPC on {source}, seed {seed}"):
            for schedule in FITTED:
                key = (*schedule, *relevant(reading, schedule[0]).values())
                if key not in fitted:
                    settings = scheduled(run_files.section("gpca_paper"), schedule)
                    gpc = StartedGPC(settings, reading, source, seed).fit(train.embedding, train.concept)
                    fitted[key] = gpc.attribute(test.embedding)[0]
                yield reading, source, method_of(schedule), seed, accuracies(test.concept, fitted[key])
                if schedule in SHOWN_AS:
                    yield reading, source, SHOWN_AS[schedule], seed, table5(test.concept, fitted[key], distance_S)


def scheduled(section: dict[str, Any], schedule: Schedule) -> GPCSettings:
    """The paper's setting with a row of Table IV's kernel, rate and iterations."""
    return GPCSettings(**section | dict(zip(("kernel", "learning_rate", "iterations"), schedule, strict=True)))


def method_of(schedule: Schedule) -> str:
    return "{}-{:g}-{}".format(*schedule)


def relevant(reading: Reading, kernel: str) -> Reading:
    """The choices that matter to a kernel: a polynomial one has no lengthscale."""
    return {name: value for name, value in reading.items() if kernel != "polynomial" or name != "lengthscale"}


def gpc_scores(settings: Mapping, train: Registrations, h_S_d: np.ndarray, *axes: object) -> np.ndarray:
    """Scores (S, C) at embeddings by the classifier of the protocol, fitted to training samples."""
    gpc = GPC(CONCEPTS, GPCSettings(**settings), *axes)
    return gpc.fit(train.embedding, train.concept).attribute(h_S_d)[0]


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

    make = {"svc": partial(SVC, kernel="linear"), "linear_svc": LinearSVC}[machine]
    svm = make(random_state=PAPERS_RANDOM_STATE)
    if probability == "platt":
        folds = min(5, *np.unique(train.concept, return_counts=True)[1])
        svm = CalibratedClassifierCV(svm, cv=folds, ensemble=False)
    fitted = make_pipeline(StandardScaler() if inputs == "standardised" else FunctionTransformer(), svm)
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
    """ρ, the area and ECE of one learner, by the names of their counterparts; entropy stands for BALD."""
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
