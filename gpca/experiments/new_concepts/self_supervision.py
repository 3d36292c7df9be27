"""An embedding without labels: an encoder learns to predict measurements of the pair.

The measurements see both clouds, the encoder the aligned source alone; so it learns what in a cloud goes with how it
lies on its model, whatever the concepts are. What it predicts is the embedding: in the few dimensions of the
measurements a few labels say more than in the hundreds of the layer before.
"""

from __future__ import annotations

import numpy as np

from gpca.encoders.settings import EncoderSettings
from gpca.encoders.training import TrainingTask, embed, train_encoder
from gpca.pairs.dataset import Registrations


def self_supervised(
    registrations: Registrations, measured_S_F: np.ndarray, source: str, seed: int, settings: EncoderSettings
) -> np.ndarray:
    """Train the encoder on the training samples without their labels, and embed every sample (S, F).

    Args:
        registrations: S of them; their concepts are not read.
        measured_S_F: of each pair, normalized.
        source, seed: they name the random numbers.
        settings: of the encoder.
    """
    train = registrations.rows("train")
    name = f"{source} without labels"
    columns = tuple(f"measurement_{i}" for i in range(measured_S_F.shape[1]))
    lessons = registrations.subset(train)
    model, _ = train_encoder(lessons, name, seed, settings, task=TrainingTask(columns, measured_S_F[train]))
    return embed(model, registrations, name, seed, settings)[1]
