"""Layers on many points: linear maps by NumPy's product, with the same bytes on every CPU, and given statistics."""

from typing import Any

import numpy as np
import torch
from torch import nn

from gpca.encoders.inference import NORM, product, scale_and_shift


def linear(x_I: torch.Tensor, weight_O_I: torch.Tensor) -> torch.Tensor:
    """Return ``x_I @ weight_O_I.T`` (…, O) of inputs (…, I), differentiable in both."""
    if x_I.device.type != "cpu":
        return x_I @ weight_O_I.T
    return _Linear.apply(x_I.flatten(0, -2), weight_O_I).view(*x_I.shape[:-1], -1)


class PointLinear(nn.Linear):
    """A linear layer whose product is :func:`linear`."""

    def forward(self, x_I: torch.Tensor) -> torch.Tensor:
        y_O = linear(x_I, self.weight)
        return y_O if self.bias is None else y_O + self.bias


class BatchNorm(nn.BatchNorm1d):
    """``nn.BatchNorm1d`` over F features with statistics from the caller; the running ones are always kept."""

    running_mean: torch.Tensor
    running_var: torch.Tensor
    num_batches_tracked: torch.Tensor
    momentum: float

    def scale_and_shift(self) -> tuple[np.ndarray, np.ndarray]:
        return scale_and_shift(*(getattr(self, part).detach().numpy() for part in NORM))

    @torch.no_grad()
    def track(self, mean_F: torch.Tensor, variance_F: torch.Tensor, count: int) -> None:
        """Update the running statistics by a batch of `count` values with this mean and biased variance."""
        self.num_batches_tracked += 1
        self.running_mean.lerp_(mean_F, self.momentum)
        self.running_var.lerp_(variance_F * (count / (count - 1)), self.momentum)


def _product(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    return torch.from_numpy(product(a.detach().numpy(), b.detach().numpy()))


class _Linear(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, x_N_I: torch.Tensor, weight_O_I: torch.Tensor) -> torch.Tensor:
        ctx.save_for_backward(x_N_I, weight_O_I)
        return _product(x_N_I, weight_O_I.T)

    @staticmethod
    def backward(ctx: Any, *grads: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        (grad_N_O,), (x_N_I, weight_O_I) = grads, ctx.saved_tensors
        wanted_x, wanted_weight = ctx.needs_input_grad
        by_x = _product(grad_N_O, weight_O_I) if wanted_x else None
        return by_x, _product(grad_N_O.T, x_N_I) if wanted_weight else None
