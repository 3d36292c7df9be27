"""GP-CA on the pair: the paper's classifier on descriptors of both clouds and of the motion of ICP.

``gpca_pair`` is the multi-class classifier. ``gpca_multilabel`` has a Gaussian process for each cause, and one for
whether anything is wrong, so that several causes may have high scores at once. ``pair_committee`` is the mean of the
scores of a forest, of boosting and of GP-CA, each on every descriptor. Names that end in ``_clouds`` see the two clouds
alone.
"""

from __future__ import annotations

import numpy as np

from baselines.descriptors import (
    ALL,
    CLOUDS,
    WITHOUT,
    DescriptorClassifier,
    boosted_trees,
    described,
    entry,
    randomized_trees,
)
from gpca.causes.dataset import LABELS
from gpca.causes.truth import NOMINAL
from gpca.classifier.settings import GPCArguments
from gpca.explainers.concept_classifier import known_concepts
from gpca.explainers.gpca import DescriptorGPCA
from gpca.explainers.interface import ConceptExplainer, ScoringExplainer, attached
from gpca.explainers.sight import Sees
from gpca.pairs.dataset import Registrations


class CausePairGPCA(DescriptorGPCA):
    """GP-CA on the descriptors of the pair that are of the parts it sees."""

    labels = LABELS

    def __init__(self, sees: Sees, source: str, seed: int, **settings: GPCArguments) -> None:
        super().__init__((source, seed, "causes"), source, seed, **settings)
        self._sees = sees

    def features(self, registrations: Registrations) -> np.ndarray:
        """Return the descriptors."""
        return described(registrations, self._sees)


class MultiLabelGPCA(ScoringExplainer):
    """Independent binary GPs: whether the registration failed, and for each concept whether it is one of the causes.

    The score of a cause is the probability that it is one, times that of a failure.
    """

    labels = LABELS

    def __init__(self, sees: Sees, source: str, seed: int, **settings: GPCArguments) -> None:
        from gpca.classifier.settings import GPCSettings
        from gpca.explainers.pair_classifier import PairClassifier

        self._sees = sees
        self._classifier = PairClassifier(GPCSettings(**settings), source, seed, "causes")

    def fit(self, registrations: Registrations) -> None:
        """Fit the four classifiers; those of the causes to the sets of causes, which are attached as ``causes``."""
        known_concepts(registrations.concept, LABELS)
        causes_N_3 = attached(registrations, "causes") > 0.5
        self._classifier.fit(described(registrations, self._sees), registrations.concept != NOMINAL, causes_N_3)

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the probabilities: of no failure, and of each cause and a failure."""
        judged = self._classifier.judge(self._classifier.normalized(described(registrations, self._sees)))
        return np.column_stack([1 - judged.failure_N, judged.failure_N[:, None] * judged.causes_N_3])


class Committee(ScoringExplainer):
    """Three explainers of unlike kinds, whose errors are not the same."""

    labels = LABELS

    def __init__(self, sees: Sees, source: str, seed: int) -> None:
        self._members: list[ConceptExplainer] = [
            DescriptorClassifier(randomized_trees(source, seed), sees),
            DescriptorClassifier(boosted_trees(source, seed), sees),
            CausePairGPCA(sees, source, seed, learning_rate=0.1, iterations=200),
        ]

    def fit(self, registrations: Registrations) -> None:
        """Fit every member."""
        for member in self._members:
            member.fit(registrations)

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the mean of the members' scores."""
        return np.mean([member.explain(registrations).scores_N_C for member in self._members], axis=0)


CAUSE_EXPLAINERS = {
    "gpca_pair": entry("GP-CA on the pair", CausePairGPCA, ALL),
    "gpca_pair_clouds": entry(f"GP-CA on the pair, {WITHOUT}", CausePairGPCA, CLOUDS),
    "gpca_multilabel": entry("GP-CA on the pair, multi-label", MultiLabelGPCA, ALL),
    "gpca_multilabel_clouds": entry(f"GP-CA on the pair, multi-label, {WITHOUT}", MultiLabelGPCA, CLOUDS),
    "pair_committee": entry("Committee on the pair", Committee, ALL),
    "pair_committee_clouds": entry(f"Committee on the pair, {WITHOUT}", Committee, CLOUDS),
}
