"""GP-CA on the pair with embeddings that are learned: the gain of a network over measured relations, and its cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from baselines.pair import PairDescription
from gpca.classifier.settings import GPCArguments
from gpca.explainers.gpca import GPCA
from gpca.explainers.interface import ExplainerEntry
from gpca.features.settings import DescribedPoints
from gpca.pairs.dataset import Registrations
from gpca.settings import Count, PositiveShare


class LearnedPairGPCA(PairDescription, GPCA):
    """GP-CA's classifier on the embedding of an encoder that sees both clouds after ICP and the motion of ICP.

    Args:
        encoder: one of :data:`gpca.encoders.pair.PAIR_ENCODERS`.
        source, seed: name what is random.
        points: of each cloud, each described by how it lies to the other cloud.
        draw_points, epochs, encoder_learning_rate: of the encoder's training, each epoch on other ones of the points.
        settings: those of the GPC, as for GP-CA.
    """

    def __init__(
        self,
        encoder: str,
        source: str,
        seed: int,
        points: DescribedPoints = 512,
        draw_points: DescribedPoints = 96,
        epochs: Count = 6,
        encoder_learning_rate: PositiveShare = 4e-3,
        **settings: GPCArguments,
    ) -> None:
        PairDescription.__init__(self, source, seed, "relations", points)
        GPCA.__init__(self, source, seed, **settings)
        self._encoder = encoder
        self._training = (min(draw_points, points), epochs, encoder_learning_rate)
        self._embedding = f"{self._prefix}embedding_by_{encoder}"
        self._embed: Callable[[Registrations], Registrations] | None = None

    def learn_encoder(self, registrations: Registrations) -> Callable[[Registrations], Registrations]:
        """Train the encoder on the labeled pairs, and return a function that attaches its embeddings."""
        from gpca.encoders.settings import EncoderSettings
        from gpca.explainers.pair_encoder import PairDraw, learn_pair_encoder
        from gpca.features.registered import MOTION

        draw = PairDraw(self._prefix + "points", self._prefix + "motion")

        def seen(pairs: Registrations) -> Registrations:
            described = self.describe(pairs)
            motion = self.features(described)[:, -MOTION:]
            return replace(described, attached={**described.attached, draw.motion: motion})

        draw_points, epochs, learning_rate = self._training
        settings = EncoderSettings(self._encoder, draw_points, draws=2, epochs=epochs, learning_rate=learning_rate)
        encoder = learn_pair_encoder(seen(registrations), settings, draw, *self._axes)

        def embed(pairs: Registrations) -> Registrations:
            described = self.describe(pairs)
            return replace(described, attached={**described.attached, self._embedding: encoder(seen(described))})

        return embed

    def fit(self, registrations: Registrations) -> None:
        """Fit the GPC to the labeled pairs, after the encoder, unless its embeddings are attached."""
        if self._embedding not in registrations.attached:
            self._embed = self.learn_encoder(registrations)
        super().fit(registrations)

    def _inputs(self, registrations: Registrations) -> np.ndarray:
        return (self._embed(registrations) if self._embed else registrations).attached[self._embedding]


EXPLAINERS = {
    "gpca_pair_dgcnn": ExplainerEntry("GP-CA on the pair (DGCNN)", partial(LearnedPairGPCA, "pair_dgcnn")),
    "gpca_pair_attention": ExplainerEntry(
        "GP-CA on the pair (cross-attention)", partial(LearnedPairGPCA, "pair_attention")
    ),
}
