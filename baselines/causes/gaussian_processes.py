"""GP-CA on the pair: the paper's classifier with other eyes, which see both clouds and what ICP did.

``gpca_pair`` is the multi-class classifier. ``gpca_multilabel`` has a Gaussian process for each cause, and one for
whether anything is wrong, so that several causes may have high scores at once.
"""

from __future__ import annotations

import numpy as np

from baselines.attached import attached
from baselines.causes.described import joined
from gpca.causes.labels import LABELS
from gpca.causes.truth import NOMINAL
from gpca.classifier.settings import GPCArguments
from gpca.explainers.concept_classifier import known_concepts
from gpca.explainers.gpca import DescriptorGPCA
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer
from gpca.features.groups import GROUPS
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS


class CausePairGPCA(DescriptorGPCA):
    """GP-CA on the descriptors of the pair."""

    labels = LABELS

    def __init__(self, source: str, seed: int, **settings: GPCArguments) -> None:
        super().__init__((source, seed, "causes"), source, seed, **settings)

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return all groups of descriptors."""
        return joined(registrations, GROUPS)


class MultiLabelGPCA(ScoringExplainer):
    """Independent binary GPs: whether the registration failed, and for each concept whether it is one of the causes.

    The score of a cause is the probability that it is one, times that of a failure.
    """

    labels = LABELS

    def __init__(self, source: str, seed: int, **settings: GPCArguments) -> None:
        from gpca.classifier.settings import GPCSettings
        from gpca.explainers.pair_classifier import PairClassifier

        self._classifier = PairClassifier(GPCSettings(**settings), source, seed, "causes")

    def fit(self, registrations: Registrations) -> None:
        """Fit the four classifiers; those of the causes to the sets of causes, which are attached as ``causes``."""
        known_concepts(registrations.concept, LABELS)
        causes_N_3 = attached(registrations, "causes", len(CONCEPTS)) > 0.5
        self._classifier.fit(joined(registrations, GROUPS), registrations.concept != NOMINAL, causes_N_3)

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the probabilities: of no failure, and of each cause and a failure."""
        judged = self._classifier.judge(self._classifier.normalized(joined(registrations, GROUPS)))
        return np.column_stack([1 - judged.failure_N, judged.failure_N[:, None] * judged.causes_N_3])


EXPLAINERS = {
    "gpca_pair": ExplainerEntry("GP-CA on the pair", CausePairGPCA, reads="descriptors"),
    "gpca_multilabel": ExplainerEntry("GP-CA on the pair, multi-label", MultiLabelGPCA, reads="descriptors"),
}
