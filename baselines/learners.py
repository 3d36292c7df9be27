"""Other learners on the embeddings that GP-CA reads: the comparison for its Gaussian process (paper, Table V).

All learn from the same labeled embeddings, standardized on them, and give probabilities of every concept. The forest
and the linear SVM are the paper's: scikit-learn's defaults, 50 trees, random_state 42.
"""

from __future__ import annotations

import numpy as np

from gpca.errors import InputError
from gpca.explainers.concept_classifier import (
    PAPERS_RANDOM_STATE,
    ClassifierExplainer,
    ConceptClassifier,
    standardized_regression,
)
from gpca.explainers.interface import ExplainerEntry, attached
from gpca.pairs.dataset import Registrations
from gpca.settings import Count, Positive


class Learner(ClassifierExplainer):
    """A scikit-learn classifier on the embeddings."""

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the embeddings."""
        return attached(registrations, "embedding")


def forest(source: str, seed: int, trees: Count = 50) -> Learner:
    """Make a random forest."""
    from sklearn.ensemble import RandomForestClassifier

    return Learner(_standardized(RandomForestClassifier(n_estimators=trees, random_state=PAPERS_RANDOM_STATE)))


class ProbableSVM(Learner):
    """A support vector machine; Platt's sigmoids over up to five folds turn its decision values into probabilities."""

    def __init__(self, kernel: str) -> None:
        self._kernel = kernel

    def fit(self, registrations: Registrations) -> None:
        """Fit to the labeled embeddings; a concept of which there is a single sample raises an InputError."""
        from sklearn.calibration import CalibratedClassifierCV
        from sklearn.svm import SVC

        folds = min(5, *np.unique(registrations.concept, return_counts=True)[1])
        if folds < 2:
            raise InputError("training registrations", "have a single sample of a concept", "give at least two")
        svm = SVC(kernel=self._kernel, random_state=PAPERS_RANDOM_STATE)
        self._classifier = ConceptClassifier(_standardized(CalibratedClassifierCV(svm, cv=folds, ensemble=False)))
        super().fit(registrations)


class Nearest(Learner):
    """A k-nearest-neighbor classifier."""

    def __init__(self, neighbours: int) -> None:
        from sklearn.neighbors import KNeighborsClassifier

        self._neighbors = neighbours
        super().__init__(_standardized(KNeighborsClassifier(neighbours)))

    def fit(self, registrations: Registrations) -> None:
        """Fit to the labeled embeddings; fewer of them than neighbors raise an InputError."""
        if self._neighbors > len(registrations):
            fault = f"{self._neighbors} neighbors are too many for {len(registrations)} training samples"
            raise InputError("learner_nearest", fault, "lower neighbours")
        super().fit(registrations)


def linear_svm(source: str, seed: int) -> Learner:
    """Make a linear support vector machine."""
    return ProbableSVM("linear")


def rbf_svm(source: str, seed: int) -> Learner:
    """Make a support vector machine with scikit-learn's default RBF kernel."""
    return ProbableSVM("rbf")


def logistic(source: str, seed: int, inverse_regularisation: Positive = 1.0) -> Learner:
    """Make a multinomial logistic regression."""
    return Learner(standardized_regression(inverse_regularisation))


def nearest(source: str, seed: int, neighbours: Count = 5) -> Learner:
    """Make a k-nearest-neighbor classifier; a probability is a share of the neighbors."""
    return Nearest(neighbours)


def laplace_gpc(source: str, seed: int, lengthscale: Positive = 1.0) -> Learner:
    """Make scikit-learn's Gaussian process classifier: one against the rest, Laplace's approximation, RBF kernel.

    Args:
        lengthscale: in units of √(2 d), the expected distance of two standardized embeddings. It stays fixed,
            since scikit-learn's optimizer takes minutes.
    """
    from sklearn.gaussian_process import GaussianProcessClassifier
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel
    from sklearn.preprocessing import FunctionTransformer

    kernel = ConstantKernel(10.0) * RBF(lengthscale)
    return Learner(
        _standardized(FunctionTransformer(_to_unit_distance), GaussianProcessClassifier(kernel, optimizer=None))
    )


def _to_unit_distance(features_N_F):
    return features_N_F / (2 * features_N_F.shape[1]) ** 0.5


def _standardized(*steps):
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    return make_pipeline(StandardScaler(), *steps)


EXPLAINERS = {
    "learner_forest": ExplainerEntry("Random forest on the embedding", forest, ("source",), reads="embeddings"),
    "learner_linear_svm": ExplainerEntry("Linear SVM on the embedding", linear_svm, ("source",), reads="embeddings"),
    "learner_rbf_svm": ExplainerEntry("RBF SVM on the embedding", rbf_svm, ("source",), reads="embeddings"),
    "learner_logistic": ExplainerEntry(
        "Logistic regression on the embedding", logistic, ("source",), reads="embeddings"
    ),
    "learner_nearest": ExplainerEntry("k nearest embeddings", nearest, ("source",), reads="embeddings"),
    "learner_laplace_gpc": ExplainerEntry("Laplace GPC on the embedding", laplace_gpc, ("source",), reads="embeddings"),
}
