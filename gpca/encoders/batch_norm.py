"""Batch norm for layers that compute its statistics themselves (:mod:`edge_conv`, :mod:`group_mlp`)."""

from __future__ import annotations

import torch
from torch import nn


class BatchNorm(nn.BatchNorm1d):
    """``nn.BatchNorm1d`` over F features that always keeps running statistics."""

    running_mean: torch.Tensor
    running_var: torch.Tensor
    num_batches_tracked: torch.Tensor
    momentum: float

    def scale_and_shift(self) -> tuple[torch.Tensor, torch.Tensor]:
        """Return scale and shift (F,) of inference: the output is ``scale * y + shift``."""
        scale_F = self.weight * torch.rsqrt(self.running_var + self.eps)
        return scale_F, self.bias - scale_F * self.running_mean

    @torch.no_grad()
    def track(self, mean_F: torch.Tensor, variance_F: torch.Tensor, count: int) -> None:
        """Take a batch of `count` values with this mean and biased variance into the running statistics."""
        self.num_batches_tracked += 1
        self.running_mean.lerp_(mean_F, self.momentum)
        self.running_var.lerp_(variance_F * (count / (count - 1)), self.momentum)
