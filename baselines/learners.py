"""Other learners on GP-CA's embeddings, standardized on the training samples (paper, Table V)."""

from functools import partial

import numpy as np

from gpca.errors import InputError
from gpca.explainers.classifiers import PAPERS_RANDOM_STATE, standardized_regression
from gpca.explainers.interface import ClassifierExplainer, ExplainerEntry, attached
from gpca.pairs.dataset import Registrations
from gpca.settings import Count, Positive


class Learner(ClassifierExplainer):
    """A scikit-learn classifier on the embeddings."""

    def features(self, registrations: Registrations) -> np.ndarray:
        return attached(registrations, "embedding")


def forest(source: str, seed: int, trees: Count = 50) -> Learner:
    from sklearn.ensemble import RandomForestClassifier

    return Learner(_standardized(RandomForestClassifier(n_estimators=trees, random_state=PAPERS_RANDOM_STATE)))


class ProbableSVM(Learner):
    """A linear support vector machine with scikit-learn's defaults, and Platt's sigmoids over up to five folds."""

    def __init__(self, source: str, seed: int) -> None:
        pass  # the classifier needs to know the samples

    def fit(self, registrations: Registrations) -> None:
        from sklearn.calibration import CalibratedClassifierCV
        from sklearn.svm import SVC

        folds = min(5, *np.unique(registrations.concept, return_counts=True)[1])
        if folds < 2:
            raise InputError("training registrations", "have a single sample of a concept", "give at least two")
        svm = SVC(kernel="linear", random_state=PAPERS_RANDOM_STATE)
        self._classifier = _standardized(CalibratedClassifierCV(svm, cv=folds, ensemble=False))
        super().fit(registrations)


class Nearest(Learner):
    """A k-nearest-neighbor classifier; a probability is a share of the neighbors."""

    def __init__(self, source: str, seed: int, neighbours: Count = 5) -> None:
        from sklearn.neighbors import KNeighborsClassifier

        self._neighbors = neighbours
        super().__init__(_standardized(KNeighborsClassifier(neighbours)))

    def fit(self, registrations: Registrations) -> None:
        if self._neighbors > len(registrations):
            fault = f"{self._neighbors} neighbors are too many for {len(registrations)} training samples"
            raise InputError("learner_nearest", fault, "lower neighbours")
        super().fit(registrations)


def logistic(source: str, seed: int, inverse_regularisation: Positive = 1.0) -> Learner:
    return Learner(standardized_regression(inverse_regularisation))


def _standardized(*steps):
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    return make_pipeline(StandardScaler(), *steps)


_entry = partial(ExplainerEntry, sees=("source",), reads="embeddings")
EXPLAINERS = {
    "learner_forest": _entry("Random forest on the embedding", forest),
    "learner_linear_svm": _entry("Linear SVM on the embedding", ProbableSVM),
    "learner_logistic": _entry("Logistic regression on the embedding", logistic),
    "learner_nearest": _entry("k nearest embeddings", Nearest),
}
