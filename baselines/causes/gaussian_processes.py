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
from gpca.causes.truth import FAILED, NOMINAL
from gpca.descriptors.groups import GROUPS
from gpca.explainers.gpca import GPCA
from gpca.explainers.interface import ExplainerEntry
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import seed_of


class NormalisedDescriptors:
    """Every descriptor mapped to a normal distribution by its ranks among the training samples.

    Distances, angles, costs and counts have tails of all kinds, in which one lengthscale would see little else.
    """

    def __init__(self, *axes: object) -> None:
        self._axes = axes
        self._features = described(GROUPS)

    def fit(self, registrations: Registrations) -> np.ndarray:
        """Learn the ranks, and return the normalised descriptors (N, F) of these registrations."""
        from sklearn.preprocessing import QuantileTransformer

        features_N_F = self._features(registrations)
        self._transformer = QuantileTransformer(
            n_quantiles=min(100, len(features_N_F)),
            output_distribution="normal",
            random_state=seed_of(*self._axes, "quantiles") % 2**32,
        ).fit(features_N_F)
        return self(registrations)

    def __call__(self, registrations: Registrations) -> np.ndarray:
        """Return the normalised descriptors (N, F)."""
        return self._transformer.transform(self._features(registrations)).clip(-3, 3)


class PairGPCA(GPCA):
    """GP-CA on the descriptors of the pair."""

    labels = LABELS

    def __init__(self, source: str, seed: int, **settings) -> None:
        super().__init__(source, seed, **settings)
        self._normalised = NormalisedDescriptors(source, seed, "causes")

    def fit(self, registrations: Registrations) -> None:
        """Learn the scales of the descriptors, and fit the classifier."""
        self._normalised.fit(registrations)
        super().fit(registrations)

    def _inputs(self, registrations: Registrations) -> np.ndarray:
        return self._normalised(registrations)


class MultiLabelGPCA:
    """Independent binary GPs: whether the registration failed, and for each concept whether it is one of the causes.

    The score of a cause is the probability that it is one, times that of a failure.
    """

    def __init__(self, source: str, seed: int, **settings) -> None:
        from gpca.classifier.gpc import GPC
        from gpca.classifier.settings import GPCSettings

        self._normalised = NormalisedDescriptors(source, seed, "causes")
        self._failure = GPC((NOMINAL, FAILED), GPCSettings(**settings), source, seed, "causes", FAILED)
        self._causes = [
            GPC(("absent", "present"), GPCSettings(**settings), source, seed, "causes", c) for c in CONCEPTS
        ]

    def fit(self, registrations: Registrations) -> None:
        """Fit the four classifiers; those of the causes to the sets of causes, which are attached as ``causes``."""
        known_concepts(registrations.concept, LABELS)
        inputs_N_F = self._normalised.fit(registrations)
        self._failure.fit(inputs_N_F, np.where(registrations.concept == NOMINAL, NOMINAL, FAILED))
        causes_N_3 = attached(registrations, "causes", len(CONCEPTS)) > 0.5
        for gpc, present_N in zip(self._causes, causes_N_3.T, strict=True):
            gpc.fit(inputs_N_F, np.where(present_N, "present", "absent"))

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration by the probabilities."""
        started = perf_counter()
        inputs_N_F = self._normalised(registrations)
        (failed, *present) = [gpc.attribute(inputs_N_F)[0][:, 1] for gpc in (self._failure, *self._causes)]
        scores_N_4 = np.column_stack([1 - failed, *(failed * probability_N for probability_N in present)])
        return Attribution.of_scores(LABELS, scores_N_4, seconds=(perf_counter() - started) / len(registrations))


EXPLAINERS = {
    "gpca_pair": ExplainerEntry("GP-CA on the pair", PairGPCA, reads="descriptors"),
    "gpca_multilabel": ExplainerEntry("GP-CA on the pair, multi-label", MultiLabelGPCA, reads="descriptors"),
}
