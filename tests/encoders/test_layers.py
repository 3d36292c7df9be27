"""The linear map of points against torch's own, values and gradients."""

import pytest
import torch
from torch import nn

from gpca.encoders.groups import PointLinear, linear


@pytest.mark.parametrize("shape", [(7, 5), (3, 7, 5), (2, 3, 7, 5)])
def test_values_and_gradients_are_those_of_torch(shape):
    generator = torch.Generator().manual_seed(100)
    x = torch.randn(shape, generator=generator, dtype=torch.float64, requires_grad=True)
    weight = torch.randn(4, 5, generator=generator, dtype=torch.float64, requires_grad=True)
    assert torch.allclose(linear(x, weight), x @ weight.T)
    assert torch.autograd.gradcheck(linear, (x, weight))


def test_parts_of_a_tensor_and_gradients_that_are_not_contiguous():
    weight = torch.arange(12.0, requires_grad=True).view(3, 4)
    x = torch.ones(2, 3, requires_grad=True)
    linear(x.T, weight[:, 1:3].contiguous()).mean().backward()
    plain = torch.ones(2, 3, requires_grad=True)
    (plain.T @ weight[:, 1:3].T).mean().backward()
    assert torch.equal(x.grad, plain.grad)


@pytest.mark.parametrize("bias", [True, False])
def test_the_layer_is_a_linear_layer(bias):
    torch.manual_seed(100)
    layer = PointLinear(5, 4, bias=bias)
    plain = nn.Linear(5, 4, bias=bias)
    plain.load_state_dict(layer.state_dict())
    x = torch.randn(3, 6, 5)
    assert torch.allclose(layer(x), plain(x), atol=1e-6)
