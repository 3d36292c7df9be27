"""GP-CA on the pair: the paper's classifier with other eyes, which see both clouds and what ICP did.

``gpca_pair`` is the multi-class classifier. ``gpca_multilabel`` has a Gaussian process for each cause, and one for
whether anything is wrong, so that several causes may have high scores at once.
"""

from __future__ import annotations

from time import perf_counter

import numpy as np

from baselines.attached import attached
from baselines.causes.described import described
from baselines.concept_classifier import known_concepts
from gpca.attribution.scores import Attribution
from gpca.causes.labels import LABELS
from gpca.causes.truth import NOMINAL
from gpca.descriptors.groups import GROUPS
from gpca.explainers.gpca import GPCA
from gpca.explainers.interface import ExplainerEntry
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS


class PairGPCA(GPCA):
    """GP-CA on the descriptors of the pair."""

    labels = LABELS

    def __init__(self, source: str, seed: int, **settings) -> None:
        from gpca.explainers.pair_classifier import NormalisedDescriptors

        super().__init__(source, seed, **settings)
        self._features = described(GROUPS)
        self._normalised = NormalisedDescriptors(source, seed, "causes")

    def fit(self, registrations: Registrations) -> None:
        """Learn the scales of the descriptors, and fit the classifier."""
        self._normalised.fit(self._features(registrations))
        super().fit(registrations)

    def _inputs(self, registrations: Registrations) -> np.ndarray:
        return self._normalised(self._features(registrations))


class MultiLabelGPCA:
    """Independent binary GPs: whether the registration failed, and for each concept whether it is one of the causes.

    The score of a cause is the probability that it is one, times that of a failure.
    """

    def __init__(self, source: str, seed: int, **settings) -> None:
        from gpca.classifier.settings import GPCSettings
        from gpca.explainers.pair_classifier import PairClassifier

        self._features = described(GROUPS)
        self._classifier = PairClassifier(GPCSettings(**settings), source, seed, "causes")

    def fit(self, registrations: Registrations) -> None:
        """Fit the four classifiers; those of the causes to the sets of causes, which are attached as ``causes``."""
        known_concepts(registrations.concept, LABELS)
        causes_N_3 = attached(registrations, "causes", len(CONCEPTS)) > 0.5
        self._classifier.fit(self._features(registrations), registrations.concept != NOMINAL, causes_N_3)

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration by the probabilities."""
        started = perf_counter()
        judged = self._classifier.judge(self._classifier.normalised(self._features(registrations)))
        scores_N_4 = np.column_stack([1 - judged.failure_N, judged.failure_N[:, None] * judged.causes_N_3])
        return Attribution.of_scores(LABELS, scores_N_4, seconds=(perf_counter() - started) / len(registrations))


EXPLAINERS = {
    "gpca_pair": ExplainerEntry("GP-CA on the pair", PairGPCA, reads="descriptors"),
    "gpca_multilabel": ExplainerEntry("GP-CA on the pair, multi-label", MultiLabelGPCA, reads="descriptors"),
}
