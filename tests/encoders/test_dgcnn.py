import numpy as np
import pytest
import torch

from gpca.encoders import dgcnn, edge_kernels, inference
from gpca.encoders.dgcnn import CHANNELS, DGCNN, MOTION, EdgeConv, PairDGCNN, knn_indices
from tests.encoders.per_edge import PerEdgeConv


@pytest.fixture(scope="module")
def encoder():
    """A small DGCNN whose running statistics have seen some clouds, ready for inference."""
    torch.manual_seed(0)
    encoder = DGCNN(k=8, point_features=32)
    encoder(clouds())
    return encoder.eval()


def clouds(batch=4, n=60):
    return torch.rand(batch, n, 3, generator=torch.Generator().manual_seed(1)) - 0.5


def test_the_published_widths_are_those_of_the_layers():
    assert [conv.weight.shape for conv in DGCNN().edge_convs] == [(64, 6), (64, 128), (128, 128), (256, 256)]
    assert {conv.k for conv in DGCNN().edge_convs} == {20}


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


TOLERANCE = {"atol": 1e-4, "rtol": 1e-4}


def layer_pair(in_features=6, out_features=32, k=8):
    torch.manual_seed(0)
    fused, reference = EdgeConv(in_features, out_features, k), PerEdgeConv(in_features, out_features, k)
    with torch.no_grad():
        # negative gammas exercise the minimum, non-zero betas the activation's kink
        fused.norm.weight.normal_()
        fused.norm.bias.normal_()
        reference.linear.weight.copy_(fused.weight)
        reference.norm.load_state_dict(fused.norm.state_dict())
    return fused, reference


def gradients(layer, weight, x, direction):
    x = x.clone().requires_grad_()
    (layer(x) * direction).sum().backward()
    return x.grad, weight.grad, layer.norm.weight.grad, layer.norm.bias.grad


@pytest.mark.parametrize("offset", [0.0, 3.0])
def test_training_agrees_with_per_edge_reference(offset):
    fused, reference = layer_pair()
    x = torch.randn(4, 60, 6) + offset
    direction = torch.randn(4, 60, 32)
    for _ in range(2):
        torch.testing.assert_close(fused(x), reference(x), **TOLERANCE)
    torch.testing.assert_close(fused.norm.running_mean, reference.norm.running_mean, **TOLERANCE)
    torch.testing.assert_close(fused.norm.running_var, reference.norm.running_var, **TOLERANCE)
    assert fused.norm.num_batches_tracked == reference.norm.num_batches_tracked
    ours = gradients(fused, fused.weight, x, direction)
    theirs = gradients(reference, reference.linear.weight, x, direction)
    for name, a, b in zip(["x", "weight", "gamma", "beta"], ours, theirs, strict=True):
        torch.testing.assert_close(a / b.abs().max(), b / b.abs().max(), **TOLERANCE, msg=lambda m, n=name: n + m)


def test_a_trained_layer_agrees_with_per_edge_reference_and_has_its_gradient_in_the_inputs():
    fused, reference = layer_pair()
    x, direction = torch.randn(4, 60, 6), torch.randn(4, 60, 32)
    fused(x), reference(x)
    torch.testing.assert_close(fused.eval()(x), reference.eval()(x), **TOLERANCE)
    inputs = x.clone().requires_grad_()
    ours, theirs = (torch.autograd.grad((layer(inputs) * direction).sum(), inputs)[0] for layer in (fused, reference))
    torch.testing.assert_close(ours, theirs, atol=1e-3, rtol=1e-3)


def test_plain_torch_path_agrees_with_fused_path():
    fused, _ = layer_pair()
    plain, _ = layer_pair()
    x = torch.randn(4, 60, 6)
    neighbours = knn_indices(x, fused.k)
    w1, w2 = plain.weight.chunk(2, dim=1)
    plain_out = dgcnn._edge_max_plain(x @ torch.cat([w1, w2 - w1]).T, neighbours.long(), plain.norm)
    fused_out = fused(x)
    torch.testing.assert_close(plain_out, fused_out, **TOLERANCE)
    plain_out.square().sum().backward()
    fused_out.square().sum().backward()
    torch.testing.assert_close(fused.weight.grad, plain.weight.grad, atol=1e-3, rtol=1e-3)


@pytest.fixture
def as_written(monkeypatch):
    """The passes uncompiled, for doubles: to compile them for these as well would take twenty seconds."""
    for name, compiled in vars(edge_kernels).copy().items():
        if hasattr(compiled, "py_func"):
            monkeypatch.setattr(edge_kernels, name, compiled.py_func)


def test_gradient_check_in_double_precision(as_written):
    layer = EdgeConv(3, 4, 5).double()
    x = torch.randn(2, 12, 3, dtype=torch.double, requires_grad=True)
    assert torch.autograd.gradcheck(lambda x: layer(x), (x,), atol=1e-6)


def rows_of_all_kinds():
    random = np.random.default_rng(0)
    yield from random.normal(size=(20, 60))
    yield from random.integers(-2, 3, size=(20, 60)).astype(float)
    yield from 1e6 + random.integers(0, 3, size=(5, 60)) * 0.0625  # the first step is lost in rounding
    yield np.r_[np.full(8, 5.0), -np.arange(52.0)]  # equal ones first, smaller ones later
    yield np.zeros(60)
    yield np.r_[np.full(10, -np.inf), np.arange(50.0)]
    yield 10.0 ** random.uniform(-30, 30, size=60)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("k", [1, 8, 60])
def test_the_smallest_are_those_of_a_stable_sort(k, dtype, request):
    if dtype == np.float64:
        request.getfixturevalue("as_written")
    rows = np.array(list(rows_of_all_kinds()), dtype)
    with np.errstate(all="ignore"):
        chosen = edge_kernels.smallest_k(rows.reshape(7, 7, 60), k).reshape(-1, k)
    np.testing.assert_array_equal(np.sort(chosen), np.sort(np.argsort(rows, kind="stable")[:, :k]))


def test_a_row_with_nan_still_names_points():
    rows = np.random.default_rng(0).normal(size=(1, 20, 30)).astype(np.float32)
    rows[0, ::2, 3] = np.nan
    rows[0, 5] = np.nan
    chosen = edge_kernels.smallest_k(rows, 8)
    assert chosen.min() >= 0
    assert chosen.max() < 30


@pytest.fixture
def pairs():
    torch.manual_seed(0)
    return torch.randn(3, 2, 16, CHANNELS), torch.randn(3, MOTION)


@pytest.fixture
def pair_encoder():
    torch.manual_seed(1)
    return PairDGCNN(k=6, widths=(8, 8), point_features=8).eval()


def test_the_order_of_points_does_not_matter_and_the_motion_is_handed_on(pair_encoder, pairs):
    points, motion = pairs
    with torch.no_grad():
        found = pair_encoder(pairs)
        assert found.shape == (3, pair_encoder.embedding_size)
        assert torch.equal(found[:, -MOTION:], motion)
        assert torch.allclose(pair_encoder((points[:, :, torch.randperm(16)], motion)), found, atol=1e-5)


def test_both_clouds_count_which_is_which_too_and_every_weight_learns(pair_encoder, pairs):
    points, motion = pairs
    with torch.no_grad():
        found = pair_encoder(pairs)[:, :-MOTION]
        swapped = pair_encoder((points.flip(1), motion))[:, :-MOTION]
        moved = points.clone()
        moved[:, 1] += 1  # the model alone
        assert not torch.allclose(swapped, found, atol=1e-3)
        assert not torch.allclose(pair_encoder((moved, motion))[:, :-MOTION], found, atol=1e-3)
    pair_encoder.train()(pairs).square().sum().backward()
    assert all(weight.grad is not None and weight.grad.abs().sum() > 0 for weight in pair_encoder.parameters())


@pytest.mark.parametrize("channels", [3, 8, 12, 16, 40, 64, 256])
def test_sums_and_norms_of_arrays_have_the_bits_of_torchs_layers(channels):
    random = np.random.default_rng(channels)
    for batch, n in ((1, 37), (2, 300), (3, 512), (1, 700)):
        x = random.normal(size=(batch, n, channels)).astype(np.float32)
        np.testing.assert_array_equal(inference._mean(x), torch.from_numpy(x).mean(dim=1).numpy())
        np.testing.assert_array_equal(inference._squares(x), torch.from_numpy(x * x).sum(dim=-1).numpy())
    norm = torch.nn.BatchNorm1d(channels).eval()
    for part in (norm.weight, norm.bias, norm.running_mean, norm.running_var):
        part.data = torch.from_numpy(random.uniform(0.1, 3, channels).astype(np.float32))
    weights = {f"norm.{name}": part.detach().numpy() for name, part in norm.state_dict().items()}
    np.testing.assert_array_equal(
        inference._normalized(x[0], weights, "norm"), norm(torch.from_numpy(x[0])).detach().numpy()
    )
