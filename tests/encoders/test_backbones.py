"""What every encoder must keep to, and the published sizes of each."""

import dataclasses

import pytest
import torch

from gpca.encoders.registry import ENCODERS, OPTIONS, EncoderSettings, make_encoder, parameter_count
from gpca.encoders.training import embed, train_encoder
from gpca.errors import InputError
from gpca.pairs.perturbation import Severities
from gpca.pairs.synthesis import RegistrationSettings, make_registrations

SMALL = {
    "dgcnn": {"k": 8, "point_features": 64},
    "pointnet": {"width": 8},
    "pointnet2": {"width": 8, "centroids": 32},
    "pointnext": {"width": 8},
}
backbones = pytest.mark.parametrize("backbone", SMALL)


def clouds(batch=4, n=96, seed=1):
    return torch.rand(batch, n, 3, generator=torch.Generator().manual_seed(seed)) - 0.5


@pytest.fixture(scope="module", params=SMALL)
def encoder(request):
    """A small encoder whose running statistics have seen some clouds, ready for inference."""
    torch.manual_seed(0)
    encoder = make_encoder(request.param, SMALL[request.param])
    for seed in range(20):
        encoder(clouds(seed=seed))
    return encoder.eval()


@pytest.mark.parametrize(
    ("n", "backbone"),
    [(n, name) for n in (1, 20, 96) for name in SMALL if (n, name) != (1, "dgcnn")],  # a point alone has no neighbors
)
def test_a_cloud_of_any_size_becomes_one_embedding(backbone, n):
    encoder = make_encoder(backbone, SMALL[backbone])
    h = encoder(clouds(3, n))
    assert h.shape == (3, encoder.embedding_size) == (3, 128)
    assert h.dtype == torch.float32
    assert h.isfinite().all()


@pytest.mark.parametrize("options", [{}, {"width": 16}])
def test_the_settings_know_the_size_of_an_embedding(options):
    assert set(SMALL) == set(ENCODERS)
    for backbone in ENCODERS:
        own = {"point_features": 24} if options and backbone == "dgcnn" else options
        assert OPTIONS[backbone](**own).embedding_size == make_encoder(backbone, own).embedding_size


POINTNET = [(64, 3), (64, 64), (64, 64), (128, 64), (1024, 128)]


def shapes(*layers):
    return [linear.weight.shape for layer in layers for linear in layer.linears]


def test_backbones_have_the_published_widths_and_numbers_of_parameters():
    encoder = make_encoder("pointnet", {})
    assert shapes(encoder.layers) == POINTNET and encoder.embedding_size == 1024
    encoder = make_encoder("pointnet2", {})
    assert shapes(*encoder.levels, encoder.whole) == [
        (64, 3 + 3), (64, 64), (128, 64), (128, 3 + 128), (128, 128), (256, 128), (256, 3 + 256), (512, 256),
        (1024, 512),
    ]  # fmt: skip
    assert encoder.embedding_size == 1024
    encoder = make_encoder("pointnext", {})
    assert encoder.embedding_size == 512
    # 1.374 million with ModelNet40's head of 512, 256 and 40 units (official implementation).
    head = (512 * 512 + 2 * 512) + (512 * 256 + 2 * 256) + (256 * 40 + 40)
    assert round((parameter_count(encoder) + head) / 1e6, 3) == 1.374


@pytest.mark.parametrize("change", [lambda p: p + 0.2, lambda p: 1.3 * p, lambda p: p.roll(1, dims=-1)])
def test_no_normalization_hides_a_shift_a_scale_or_a_rotation(encoder, change):
    assert (encoder(change(clouds())) - encoder(clouds())).abs().max() > 1e-2


def test_an_embedding_depends_neither_on_the_order_of_points_nor_on_other_clouds(encoder):
    # Point 0 is where the sampling of centroids starts; a ball that is not full holds the same points anyway.
    points = clouds()
    order = torch.cat([torch.zeros(1, dtype=torch.long), 1 + torch.randperm(points.shape[1] - 1)])
    torch.testing.assert_close(encoder(points[:, order]), encoder(points), atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(encoder(clouds()[2:3]), encoder(clouds())[2:3], atol=1e-5, rtol=1e-5)


@backbones
def test_the_gradient_reaches_every_parameter(backbone):
    torch.manual_seed(0)
    encoder = make_encoder(backbone, SMALL[backbone])
    for parameter in encoder.parameters():  # a T-Net starts at zeros, behind which there is no gradient
        parameter.data += 0.01 * torch.randn(parameter.shape)
    h = encoder(clouds())
    (h * torch.randn(h.shape)).sum().backward()
    for name, parameter in encoder.named_parameters():
        assert parameter.grad is not None and parameter.grad.isfinite().all() and parameter.grad.any(), name


@pytest.fixture(scope="module")
def easy(objects):
    severe = Severities(noise=(0.06, 0.08), rotation_deg=(60, 120), translation=(0.4, 0.6), crop=(0.5, 0.7))
    return make_registrations(objects, "tiny", 0, RegistrationSettings(48, 3, 256, severe))[0]


@backbones
def test_concepts_are_learned_and_embeddings_repeat(easy, backbone):
    settings = EncoderSettings(backbone, draw_points=64, draws=1, epochs=12, batch_size=12, options=SMALL[backbone])
    model, curve = train_encoder(easy, "tiny", 0, settings)
    assert curve[-1]["loss"] < 0.7 * curve[0]["loss"]
    assert max(epoch["accuracy"] for epoch in curve[-4:]) > 0.7  # a single epoch's goes up and down
    again, _ = train_encoder(easy, "tiny", 0, settings)
    h_S_d, _ = embed(model, easy, "tiny", 0, settings)
    assert (embed(again, easy, "tiny", 0, settings)[0] == h_S_d).all()
    in_other_batches, _ = embed(model, easy, "tiny", 0, dataclasses.replace(settings, batch_size=5))
    assert abs(in_other_batches - h_S_d).max() < 1e-4
    assert h_S_d.dtype == "float32" and not model.training


@backbones
def test_an_option_it_does_not_have_is_refused(backbone):
    with pytest.raises(InputError, match=f"backbone '{backbone}': .*widht"):
        make_encoder(backbone, {"widht": 8})
