"""An encoder of registered pairs: trained as for clouds, on features that relate each point to the other cloud."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch

from gpca.encoders.dgcnn import PAIR_ENCODERS
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import TrainingTask, embed, train_encoder
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
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


def learn_pair_encoder(
    registrations: Registrations,
    settings: EncoderSettings,
    draw: PairDraw,
    source: str,
    seed: int,
    classes: tuple[str, ...] = CONCEPTS,
) -> Callable[[Registrations], np.ndarray]:
    """Train an encoder with a head over the classes, drop the head, and return a function to embeddings (N, d).

    Args:
        registrations: labeled, with the arrays of `draw` attached; all are learned from, whatever their split.
        settings: how it is trained; the backbone is one of :data:`gpca.encoders.dgcnn.PAIR_ENCODERS`.
        draw: the view of the encoder.
        source, seed: name what is random.
        classes: the labels.
    """
    make = PAIR_ENCODERS[settings.backbone]
    task = TrainingTask(classes, make=lambda: make(**settings.options), draw=draw)
    taught = replace(registrations, split=np.full(len(registrations), "train"))
    model, _ = train_encoder(taught, source, seed, settings, task=task)
    return lambda asked: embed(model, asked, source, seed, settings, draw)[0]
