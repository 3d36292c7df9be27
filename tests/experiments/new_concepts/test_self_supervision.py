from dataclasses import replace

import numpy as np
import pytest

from gpca.encoders.settings import EncoderSettings
from gpca.experiments.new_concepts.step import self_supervised

SETTINGS = EncoderSettings(draw_points=64, draws=1, epochs=30, batch_size=12, options={"k": 8, "point_features": 16})


@pytest.fixture(scope="module")
def measured(registrations):
    """Two numbers of each cloud that an encoder can see: its height, and how far it reaches from the middle."""
    clouds = [registrations.cloud(row) for row in range(len(registrations))]
    numbers_S_2 = np.array([[np.ptp(cloud[:, 2]), np.linalg.norm(cloud, axis=1).mean()] for cloud in clouds])
    return (numbers_S_2 - numbers_S_2.mean(axis=0)) / numbers_S_2.std(axis=0)


def test_the_embedding_is_what_the_encoder_predicts_of_the_pair(registrations, measured):
    embedding = self_supervised(registrations, measured, "tiny", 100, SETTINGS)
    assert embedding.shape == measured.shape
    train = registrations.rows("train")
    assert np.square(embedding - measured)[train].mean() < 0.9 * np.square(measured)[train].mean()


def test_no_label_is_read(registrations, measured):
    brief = replace(SETTINGS, epochs=1)
    unknown = replace(registrations, concept=np.full(len(registrations), "unknown"))
    one, other = (self_supervised(given, measured, "tiny", 100, brief) for given in (registrations, unknown))
    assert np.array_equal(one, other)
