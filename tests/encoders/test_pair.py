import pytest
import torch

from gpca.encoders.dgcnn import CHANNELS, MOTION, PAIR_ENCODERS
from gpca.encoders.layers import stacked_product

OPTIONS = {"pair_dgcnn": {"k": 6, "widths": (8, 8), "point_features": 8}}


@pytest.fixture
def pairs():
    torch.manual_seed(0)
    return torch.randn(3, 2, 16, CHANNELS), torch.randn(3, MOTION)


@pytest.fixture(params=PAIR_ENCODERS)
def encoder(request):
    torch.manual_seed(1)
    return PAIR_ENCODERS[request.param](**OPTIONS[request.param]).eval()


def test_the_order_of_points_does_not_matter_and_the_motion_is_handed_on(encoder, pairs):
    points, motion = pairs
    with torch.no_grad():
        found = encoder(pairs)
        assert found.shape == (3, encoder.embedding_size)
        assert torch.equal(found[:, -MOTION:], motion)
        assert torch.allclose(encoder((points[:, :, torch.randperm(16)], motion)), found, atol=1e-5)


def test_both_clouds_count_and_which_is_which(encoder, pairs):
    points, motion = pairs
    with torch.no_grad():
        found = encoder(pairs)[:, :-MOTION]
        swapped = encoder((points.flip(1), motion))[:, :-MOTION]
        moved = points.clone()
        moved[:, 1] += 1  # the model alone
        assert not torch.allclose(swapped, found, atol=1e-3)
        assert not torch.allclose(encoder((moved, motion))[:, :-MOTION], found, atol=1e-3)


def test_every_weight_of_an_encoder_learns(encoder, pairs):
    encoder.train()(pairs).square().sum().backward()
    assert all(weight.grad is not None and weight.grad.abs().sum() > 0 for weight in encoder.parameters())


def test_a_stacked_product_has_the_gradients_of_torchs():
    a, b = torch.randn(2, 3, 4, 5), torch.randn(2, 3, 5, 6)
    gradients = []
    for multiply in (stacked_product, torch.matmul):
        x, y = a.clone().requires_grad_(), b.clone().requires_grad_()
        multiply(x, y).sin().sum().backward()
        gradients.append(torch.cat([x.grad.flatten(), y.grad.flatten()]))
    assert torch.allclose(*gradients, atol=1e-5)
