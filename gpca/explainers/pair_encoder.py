"""An encoder of registered pairs: trained like that of clouds, on what their points are told of the other cloud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from gpca.encoders.pair import PAIR_ENCODERS
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.training import Classifier, embed, train_encoder
from gpca.pairs.dataset import Registrations
from gpca.seeds import generator


@dataclass(frozen=True)
class PairDraw:
    """Draws of some points of either cloud.

    Attributes:
        points, motion: names of the attached arrays (S, 2, P, F) and (S, M).
    """

    points: str
    motion: str

    def __call__(
        self, registrations: Registrations, rows: np.ndarray, n_points: int, *axes: object, fewest: int | None = None
    ) -> list[torch.Tensor]:
        """Return `n_points` random points of either cloud, (B, 2, n_points, F), and the motions (B, M)."""
        points_S_2_P_F = registrations.attached[self.points]
        drawn = []
        for row in rows:
            random = generator(*axes, registrations.split[row], registrations.sample[row])
            chosen_2_T = [random.choice(points_S_2_P_F.shape[2], n_points, False, shuffle=False) for _ in range(2)]
            drawn.append([cloud[chosen] for cloud, chosen in zip(points_S_2_P_F[row], chosen_2_T, strict=True)])
        motion_B_M = registrations.attached[self.motion][rows]
        return [torch.from_numpy(np.array(drawn, np.float32)), torch.from_numpy(motion_B_M.astype(np.float32))]


class PairEncoder:
    """One of :data:`gpca.encoders.pair.PAIR_ENCODERS`, with its training.

    Args:
        settings: how it is trained; the backbone is its name.
        draw: what it sees.
        source, seed: name what is random.
    """

    def __init__(self, settings: EncoderSettings, draw: PairDraw, source: str, seed: int) -> None:
        self._settings, self._draw, self._axes = settings, draw, (source, seed)
        self._model: Classifier | None = None

    def fit(self, registrations: Registrations) -> PairEncoder:
        """Train it with a head over the concepts, and drop the head."""
        make = PAIR_ENCODERS[self._settings.backbone]
        self._model, _ = train_encoder(
            registrations, *self._axes, self._settings, make=lambda: make(**self._settings.options), draw=self._draw
        )
        return self

    def __call__(self, registrations: Registrations) -> np.ndarray:
        """Return embeddings (N, d)."""
        return embed(self._model, registrations, *self._axes, self._settings, self._draw)[0]
