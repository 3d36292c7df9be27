import dataclasses
from collections import OrderedDict

import numpy as np
import pytest
import torch

from gpca.encoders.registry import EncoderSettings, make_encoder
from gpca.encoders.training import draw_points, embed

SETTINGS = EncoderSettings(draw_points=64, draws=2, batch_size=12, options={"k": 8, "point_features": 16})


@pytest.fixture(scope="module")
def model():
    torch.manual_seed(0)
    encoder = make_encoder("dgcnn", SETTINGS.options)
    head = torch.nn.Linear(encoder.embedding_size, 3)
    return torch.nn.Sequential(OrderedDict(encoder=encoder, head=head)).eval()


def test_points_are_of_the_cloud_and_named_by_sample_not_by_batch(registrations):
    together = draw_points(registrations, np.array([4, 9, 40]), 32, "tiny", 0, "epoch", 1)
    assert together.shape == (3, 32, 3)
    for drawn, row in zip(together.numpy(), (4, 9, 40), strict=True):
        cloud = {tuple(point) for point in registrations.cloud(row)}
        assert len({tuple(point) for point in drawn} & cloud) == 32
        alone = draw_points(registrations.subset(np.array([row])), np.array([0]), 32, "tiny", 0, "epoch", 1)
        assert np.array_equal(alone[0], drawn)
    other = draw_points(registrations, np.array([4, 9, 40]), 32, "tiny", 0, "epoch", 2)
    assert not torch.equal(other, together)


def test_a_cloud_of_fewer_points_repeats_some(registrations):
    row = int(np.diff(registrations.offsets).argmin())
    cloud = registrations.cloud(row)
    drawn = draw_points(registrations, np.array([row]), 2 * len(cloud), "tiny", 0)[0].numpy()
    assert drawn.shape == (2 * len(cloud), 3)
    assert {tuple(point) for point in drawn} <= {tuple(point) for point in cloud}


def test_embeddings_do_not_depend_on_the_batch_size(registrations, model):
    h, _ = embed(model, registrations, "tiny", 0, SETTINGS)
    assert h.shape == (len(registrations), model.encoder.embedding_size)
    assert h.dtype == np.float32
    in_other_batches, _ = embed(model, registrations, "tiny", 0, dataclasses.replace(SETTINGS, batch_size=5))
    assert np.abs(h - in_other_batches).max() < 1e-5


def test_an_embedding_is_the_mean_over_its_draws(registrations, model):
    rows = np.arange(len(registrations))
    with torch.no_grad():
        draws = [model.encoder(draw_points(registrations, rows, 64, "tiny", 0, "embedding", draw)) for draw in range(2)]
    h, logits = embed(model, registrations, "tiny", 0, SETTINGS)
    assert np.abs(h - sum(draws).numpy() / 2).max() < 1e-5
    with torch.no_grad():
        of_draws = sum(model.head(draw) for draw in draws).numpy() / 2
    assert np.abs(logits - of_draws).max() < 1e-5
    assert np.ptp(logits, axis=0).min() > 1e-3
    assert (draws[0] - draws[1]).abs().max() > 1e-3
