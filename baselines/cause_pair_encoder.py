"""Causes by an encoder of the pair that is learned from the same samples as every other row: GP-CA on its embedding.

What the committees measure on a pair, a network here finds by itself: a small DGCNN on both clouds where ICP put them.
``gpca_pair_dgcnn`` is told the numbers of ICP's motion and of its runs from other starts too; ``_clouds`` knows the
clouds, and how well ICP says they fit.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from baselines.descriptors import CLOUDS, WITH_RUNS, WITHOUT, described, entry
from baselines.learned_pair import LearnedPairGPCA
from gpca.causes.dataset import LABELS
from gpca.causes.descriptors import EVERY, Columns
from gpca.causes.settings import DescribedPoints
from gpca.classifier.settings import GPCArguments
from gpca.explainers.sight import Sees
from gpca.pairs.dataset import Registrations
from gpca.settings import Count, PositiveShare

TOLD: Columns = {"motion": EVERY, "starts": EVERY}


class CausePairGPCA(LearnedPairGPCA):
    """GP-CA's classifier on the embedding of a DGCNN that sees both clouds after ICP.

    Args:
        sees: the parts whose numbers of motion and runs it is told, by their ranks among the training samples.
        source, seed: name what is random.
        points, draw_points, epochs, encoder_learning_rate, settings: as for
            :class:`baselines.learned_pair.LearnedPairGPCA`.
    """

    labels = LABELS

    def __init__(
        self,
        sees: Sees,
        source: str,
        seed: int,
        points: DescribedPoints = 512,
        draw_points: DescribedPoints = 96,
        epochs: Count = 24,  # on development objects, 6 leave it 4 points lower, and 60 gain nothing
        encoder_learning_rate: PositiveShare = 4e-3,
        **settings: GPCArguments,
    ) -> None:
        from gpca.explainers.pair_classifier import NormalizedFeatures

        training = (points, draw_points, epochs, encoder_learning_rate)
        super().__init__("pair_dgcnn", "motion" in sees, source, seed, *training, **settings)
        self._sees = sees
        self._normalized = NormalizedFeatures(source, seed, "pair encoder")

    def learn_encoder(self, registrations: Registrations) -> Callable[[Registrations], Registrations]:
        """Learn the scales of the numbers, train the encoder, and return a function that attaches its embeddings."""
        self._normalized.fit(described(registrations, self._sees, TOLD))
        return super().learn_encoder(registrations)

    def told(self, registrations: Registrations) -> np.ndarray:
        """Return the numbers of motion and runs (N, M) that it may see, normalized."""
        return self._normalized(described(registrations, self._sees, TOLD))


CAUSE_EXPLAINERS = {
    "gpca_pair_dgcnn": entry("GP-CA on the pair (DGCNN)", CausePairGPCA, WITH_RUNS),
    "gpca_pair_dgcnn_clouds": entry(f"GP-CA on the pair (DGCNN), {WITHOUT}", CausePairGPCA, CLOUDS),
}
