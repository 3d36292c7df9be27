import math

import gpytorch
import pytest
import torch

from gpca.classifier.sparse_gp import COVARIANCES, cross_covariance, make_covariance, variance

RANDOM = torch.Generator().manual_seed(0)
A, B = torch.randn(7, 12, generator=RANDOM), torch.randn(5, 12, generator=RANDOM)


def unlike(name):
    """Three kernels with parameters of their own."""
    kernel = make_covariance(name, 3, lengthscale=3.0)
    kernel.outputscale = torch.tensor([0.5, 1.0, 2.0])
    if kernel.base_kernel.has_lengthscale:
        kernel.base_kernel.lengthscale = torch.tensor([2.0, 3.0, 5.0])[:, None, None]
    else:
        kernel.base_kernel.offset = torch.tensor([0.1, 0.7, 2.0])[:, None]
    return kernel


@pytest.mark.parametrize("name", COVARIANCES)
def test_covariances_and_their_gradients_are_gpytorchs(name):
    ours, theirs = unlike(name), unlike(name)
    gradients = []
    for kernel, value in ((ours, cross_covariance(ours, A, B)), (theirs, theirs(A, B).to_dense())):
        (value * torch.arange(3.0)[:, None, None]).sum().backward()
        gradients.append([parameter.grad for parameter in kernel.parameters()])
    assert torch.allclose(cross_covariance(ours, A, B), theirs(A, B).to_dense(), atol=1e-5)
    for own, their in zip(*gradients, strict=True):
        assert torch.allclose(own, their, rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("name", COVARIANCES)
@pytest.mark.parametrize("n", [3, 7])
def test_the_variance_is_the_covariances_diagonal(name, n):
    kernel = unlike(name)
    diagonal = cross_covariance(kernel, A[:n], A[:n]).diagonal(dim1=1, dim2=2)
    assert variance(kernel, A[:n]).shape == (3, n)
    assert torch.allclose(variance(kernel, A[:n]), diagonal, atol=1e-5)


@pytest.mark.parametrize("n", [3, 7])  # as many inputs as latents, and more
@pytest.mark.parametrize("form", [gpytorch.kernels.RQKernel, gpytorch.kernels.LinearKernel])
def test_a_kernel_without_a_form_here_is_that_of_gpytorch(form, n, monkeypatch):
    monkeypatch.setitem(COVARIANCES, "new", form)
    kernel = make_covariance("new", 3, lengthscale=3.0)
    kernel.outputscale = torch.tensor([0.5, 1.0, 2.0])
    assert torch.allclose(cross_covariance(kernel, A, B), kernel(A, B).to_dense())
    diagonal = cross_covariance(kernel, A[:n], A[:n]).diagonal(dim1=1, dim2=2)
    assert variance(kernel, A[:n]).shape == (3, n)
    assert torch.allclose(variance(kernel, A[:n]), diagonal, atol=1e-5)


@pytest.mark.parametrize("name", COVARIANCES)
def test_gradients_stay_finite_where_inputs_coincide(name):
    inputs = A[[0, 0, 1]].clone().requires_grad_()
    cross_covariance(unlike(name), inputs, inputs).sum().backward()
    assert torch.isfinite(inputs.grad).all()


def test_the_polynomial_is_that_of_inputs_divided_by_the_root_of_their_number():
    kernel = make_covariance("polynomial", 1, lengthscale=1.0)
    x = torch.ones(1, 400)
    expected = kernel.outputscale * (1 + math.log(2)) ** 2  # an offset starts at softplus(0)
    assert cross_covariance(kernel, x, x).item() == pytest.approx(expected.item(), rel=1e-6)
