"""GP-CA on the pair with embeddings that are learned: the gain of a network over measured relations, and its cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from baselines.pair import CLOUDS, WITH_MOTION, WITHOUT, PairDescription
from gpca.causes.settings import DescribedPoints
from gpca.classifier.settings import GPCArguments
from gpca.explainers.gpca import GPCA
from gpca.explainers.interface import ExplainerEntry
from gpca.pairs.dataset import Registrations
from gpca.settings import Count, PositiveShare


class LearnedPairGPCA(PairDescription, GPCA):
    """GP-CA's classifier on the embedding of an encoder that sees both clouds after ICP and the motion of ICP.

    Args:
        encoder: one of :data:`gpca.encoders.dgcnn.PAIR_ENCODERS`.
        motion: whether it is told how far ICP moved the cloud.
        source, seed: name what is random.
        points: of each cloud, each described by how it lies to the other cloud.
        draw_points, epochs, encoder_learning_rate: of the encoder's training, each epoch on other ones of the points.
        settings: those of the GPC, as for GP-CA.
    """

    def __init__(
        self,
        encoder: str,
        motion: bool,
        source: str,
        seed: int,
        points: DescribedPoints = 512,
        draw_points: DescribedPoints = 96,
        epochs: Count = 6,
        encoder_learning_rate: PositiveShare = 4e-3,
        **settings: GPCArguments,
    ) -> None:
        PairDescription.__init__(self, source, seed, "relations", points, motion)
        GPCA.__init__(self, source, seed, **settings)
        self._encoder = encoder
        self._training = (min(draw_points, points), epochs, encoder_learning_rate)
        self._embedding = f"{self._prefix}embedding_by_{encoder}" + ("" if motion else "_without_motion")
        self._embed: Callable[[Registrations], Registrations] | None = None

    def learn_encoder(self, registrations: Registrations) -> Callable[[Registrations], Registrations]:
        """Train the encoder on the labeled pairs, and return a function that attaches its embeddings."""
        from gpca.encoders.registry import EncoderSettings
        from gpca.explainers.pair_encoder import PairDraw, learn_pair_encoder

        draw = PairDraw(self._prefix + "points", self._prefix + "told")

        def seen(pairs: Registrations) -> Registrations:
            described = self.describe(pairs)
            return replace(described, attached={**described.attached, draw.motion: self.told(described)})

        labeled = seen(registrations)
        draw_points, epochs, learning_rate = self._training
        settings = EncoderSettings(
            *(self._encoder, draw_points),
            draws=2,
            epochs=epochs,
            learning_rate=learning_rate,
            options={"motion": labeled.attached[draw.motion].shape[1]},
        )
        encoder = learn_pair_encoder(labeled, settings, draw, *self._axes, classes=self.labels)

        def embed(pairs: Registrations) -> Registrations:
            described = self.describe(pairs)
            return replace(described, attached={**described.attached, self._embedding: encoder(seen(described))})

        return embed

    def told(self, registrations: Registrations) -> np.ndarray:
        """Return what the encoder is told of the motion of ICP (N, M), the last of the relations."""
        from gpca.pairs.description import FIT, MOTION

        return self.features(registrations)[:, -(MOTION if self._motion else FIT) :]

    def fit(self, registrations: Registrations) -> None:
        """Fit the GPC to the labeled pairs, after the encoder, unless its embeddings are attached."""
        if self._embedding not in registrations.attached:
            registrations = self.describe(registrations)
            self._embed = self.learn_encoder(registrations)
        super().fit(registrations)

    def _inputs(self, registrations: Registrations) -> np.ndarray:
        return (self._embed(registrations) if self._embed else registrations).attached[self._embedding]


ENCODERS = {"dgcnn": "DGCNN"}
EXPLAINERS = {
    f"gpca_pair_{name}": ExplainerEntry(
        f"GP-CA on the pair ({words})", partial(LearnedPairGPCA, f"pair_{name}", True), WITH_MOTION
    )
    for name, words in ENCODERS.items()
} | {
    f"gpca_pair_{name}_clouds": ExplainerEntry(
        f"GP-CA on the pair ({words}), {WITHOUT}", partial(LearnedPairGPCA, f"pair_{name}", False), CLOUDS
    )
    for name, words in ENCODERS.items()
}
