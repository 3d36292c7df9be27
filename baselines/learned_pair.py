"""GP-CA on the embedding of a small DGCNN that sees both clouds after ICP: concepts, and causes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from baselines import descriptors
from baselines.pair import CLOUDS, WITH_MOTION, WITHOUT, PairDescription
from gpca.causes.dataset import LABELS
from gpca.causes.descriptors import EVERY, Columns
from gpca.causes.settings import DescribedPoints
from gpca.classifier.settings import GPCArguments
from gpca.explainers.gpca import GPCA
from gpca.explainers.interface import ExplainerEntry, Sees
from gpca.pairs.dataset import Registrations
from gpca.seeds import generator
from gpca.settings import Count

if TYPE_CHECKING:
    import torch

ENCODER = "pair_dgcnn"
NUMBERS: Columns = {"motion": EVERY, "starts": EVERY}  # that an encoder for causes reads beside the clouds


class LearnedPairGPCA(PairDescription, GPCA):
    """GP-CA's classifier on the embedding of an encoder of pairs, which may read how far ICP moved the cloud."""

    def __init__(
        self,
        sees: Sees,
        source: str,
        seed: int,
        points: DescribedPoints = 512,
        draw_points: DescribedPoints = 96,
        epochs: Count = 6,
        **settings: GPCArguments,
    ) -> None:
        motion = "motion" in sees
        PairDescription.__init__(self, source, seed, "relations", points, motion)
        GPCA.__init__(self, source, seed, **settings)
        self._sees, self._epochs, self._draw_points = sees, epochs, min(draw_points, points)
        self._embedding = f"{self._prefix}embedding_by_{ENCODER}" + ("" if motion else "_without_motion")
        self._embed: Callable[[Registrations], Registrations] | None = None

    def learn_encoder(self, registrations: Registrations) -> Callable[[Registrations], Registrations]:
        """Train the encoder with a head on all labeled pairs, and return a function that attaches its embeddings."""
        from gpca.encoders.dgcnn import PairDGCNN
        from gpca.encoders.registry import EncoderSettings
        from gpca.encoders.training import embed, train_encoder

        motion = self._prefix + "encoder_motion"

        def seen(pairs: Registrations) -> Registrations:
            described = self.describe(pairs)
            return replace(described, attached={**described.attached, motion: self.motion(described)})

        labeled = seen(registrations)
        options: dict[str, Any] = {"motion": labeled.attached[motion].shape[1]}
        settings = EncoderSettings(ENCODER, self._draw_points, draws=2, epochs=self._epochs, options=options)
        draw = partial(draw_pairs, self._prefix + "points", motion)
        make = partial(PairDGCNN, **options)
        all_rows = replace(labeled, split=np.full(len(labeled), "train"))
        model, _ = train_encoder(all_rows, *self._axes, settings, classes=self.labels, make=make, draw=draw)

        def with_embeddings(pairs: Registrations) -> Registrations:
            described = self.describe(pairs)
            h_N_d, _ = embed(model, seen(described), *self._axes, settings, draw)
            return replace(described, attached={**described.attached, self._embedding: h_N_d})

        return with_embeddings

    def motion(self, registrations: Registrations) -> np.ndarray:
        """Return the encoder's numbers of the motion of ICP (N, M), the last of the relations."""
        from gpca.pairs.distances import FIT, MOTION

        return self.features(registrations)[:, -(MOTION if self._motion else FIT) :]

    def fit(self, registrations: Registrations) -> None:
        """Fit the GPC to the labeled pairs, after the encoder unless its embeddings are attached."""
        if self._embedding not in registrations.attached:
            registrations = self.describe(registrations)
            self._embed = self.learn_encoder(registrations)
        super().fit(registrations)

    def _inputs(self, registrations: Registrations) -> np.ndarray:
        return (self._embed(registrations) if self._embed else registrations).attached[self._embedding]


def draw_pairs(
    points: str, motion: str, registrations: Registrations, rows: np.ndarray, n_points: int, *axes: object, **_: object
) -> list[torch.Tensor]:
    """Draw `n_points` random points of either cloud, (B, 2, n_points, F), with the motions (B, M)."""
    import torch

    points_S_2_P_F = registrations.attached[points]
    drawn = []
    for row in rows:
        random = generator(*axes, registrations.split[row], registrations.sample[row])
        drawn.append([random.choice(cloud, n_points, replace=False, shuffle=False) for cloud in points_S_2_P_F[row]])
    motion_B_M = registrations.attached[motion][rows]
    return [torch.from_numpy(np.array(drawn, np.float32)), torch.from_numpy(motion_B_M.astype(np.float32))]


class CauseLearnedPairGPCA(LearnedPairGPCA):
    """The same for causes: beside the clouds, it reads the ranks of the numbers of motion and runs that it sees."""

    labels = LABELS

    def learn_encoder(self, registrations: Registrations) -> Callable[[Registrations], Registrations]:
        from gpca.explainers.pair_classifier import NormalizedFeatures

        self._normalized = NormalizedFeatures(*self._axes, "pair encoder")
        self._normalized.fit(descriptors.described(registrations, self._sees, NUMBERS))
        return super().learn_encoder(registrations)

    def motion(self, registrations: Registrations) -> np.ndarray:
        return self._normalized(descriptors.described(registrations, self._sees, NUMBERS))


TITLE = "GP-CA on the pair (DGCNN)"
EXPLAINERS = {
    "gpca_pair_dgcnn": ExplainerEntry(TITLE, partial(LearnedPairGPCA, WITH_MOTION), WITH_MOTION),
    "gpca_pair_dgcnn_clouds": ExplainerEntry(f"{TITLE}, {WITHOUT}", partial(LearnedPairGPCA, CLOUDS), CLOUDS),
}
# On development objects, 6 epochs leave it 4 points lower, and 60 gain nothing.
_for_causes = partial(CauseLearnedPairGPCA, epochs=24)
CAUSE_EXPLAINERS = {
    "gpca_pair_dgcnn": descriptors.entry(TITLE, _for_causes, descriptors.WITH_RUNS),
    "gpca_pair_dgcnn_clouds": descriptors.entry(f"{TITLE}, {descriptors.WITHOUT}", _for_causes, CLOUDS),
}
