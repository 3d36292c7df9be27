import pytest
import torch

from gpca.encoders.dgcnn import DGCNN


@pytest.fixture(scope="module")
def encoder():
    """A small DGCNN whose running statistics have seen some clouds, ready for inference."""
    torch.manual_seed(0)
    encoder = DGCNN(k=8, point_features=32)
    encoder(clouds())
    return encoder.eval()


def clouds(batch=4, n=60):
    return torch.rand(batch, n, 3, generator=torch.Generator().manual_seed(1)) - 0.5


@pytest.mark.parametrize("point_features", [16, 32])
@pytest.mark.parametrize(("batch", "n"), [(1, 20), (3, 60)])
def test_a_cloud_becomes_one_embedding(batch, n, point_features):
    encoder = DGCNN(k=8, point_features=point_features)
    assert encoder.embedding_size == 2 * point_features
    h = encoder(clouds(batch, n))
    assert h.shape == (batch, encoder.embedding_size)
    assert h.dtype == torch.float32
    assert h.isfinite().all()


def test_the_published_widths_are_those_of_the_layers():
    assert [conv.weight.shape for conv in DGCNN().edge_convs] == [(64, 6), (64, 128), (128, 128), (256, 256)]
    assert {conv.k for conv in DGCNN().edge_convs} == {20}


def test_the_order_of_the_points_does_not_matter(encoder):
    points = clouds()
    order = torch.randperm(points.shape[1], generator=torch.Generator().manual_seed(2))
    torch.testing.assert_close(encoder(points[:, order]), encoder(points), atol=1e-4, rtol=1e-4)


def test_a_cloud_does_not_depend_on_the_others_of_its_batch(encoder):
    torch.testing.assert_close(encoder(clouds()[2:3]), encoder(clouds())[2:3], atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("change", [lambda p: p + 0.2, lambda p: 1.3 * p, lambda p: p.roll(1, dims=-1)])
def test_no_normalization_hides_a_shift_a_scale_or_a_rotation(encoder, change):
    assert (encoder(change(clouds())) - encoder(clouds())).abs().max() > 1e-2


def test_max_and_mean_pooling_stand_side_by_side(encoder):
    maximum, mean = encoder(clouds()).chunk(2, dim=1)
    assert (maximum > mean).all()


def test_the_gradient_reaches_every_parameter():
    torch.manual_seed(0)
    encoder = DGCNN(k=8, point_features=32)
    h = encoder(clouds())
    (h * torch.randn(h.shape)).sum().backward()
    for name, parameter in encoder.named_parameters():
        assert parameter.grad is not None and parameter.grad.isfinite().all() and parameter.grad.any(), name


def test_clouds_of_unlike_sizes_are_embedded_as_each_alone(encoder):
    of_sizes = [clouds()[row, :n] for row, n in enumerate((60, 20, 41))]
    alone = torch.cat([encoder(cloud[None]) for cloud in of_sizes])
    torch.testing.assert_close(encoder(of_sizes), alone, atol=1e-5, rtol=1e-5)


def test_training_takes_the_statistics_of_all_clouds_whatever_their_sizes():
    def gradients(points):
        torch.manual_seed(0)
        encoder = DGCNN(k=8, point_features=32)
        h = encoder(points)
        (h * torch.linspace(-1, 1, h.numel()).view_as(h)).sum().backward()
        return h, encoder.edge_convs[0].weight.grad

    for one, other in zip(gradients(clouds()), gradients(list(clouds())), strict=True):
        torch.testing.assert_close(one, other, atol=1e-3, rtol=1e-3)
