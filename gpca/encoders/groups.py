"""PointNets on the points of groups (Qi et al. 2017, 2017b), evaluated once per distinct point instead of per slot.

Each of a group's k slots holds a point j and is mapped by shared layers; the maximum over the slots is the group's
feature. Two equalities save most of the work:

- The first linear map W = [Wx | Wf] of ``[(p_j - c_g)/r ; f_j]`` splits into A_j + C_g with A_j = Wx p_j/r + Wf f_j and
  C_g = -Wx c_g/r: a matrix product over the points, not over the slots of all groups.
- A ball with fewer than k points repeats its first one, which batch norm counts by a weight.

``GroupMLP.plain`` is the same without these, for CUDA.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import torch
from torch import nn

from gpca.encoders import group_kernels as kernels
from gpca.encoders.inference import NORM, product, scale_and_shift


@dataclass(frozen=True)
class Groups:
    """M groups of k points in each of B clouds."""

    centers_B_M_3: torch.Tensor  # origins of the groups' coordinates
    neighbors_B_M_k: torch.Tensor  # indices of the groups' points in the cloud
    counts_B_M: torch.Tensor  # numbers of distinct points; the other slots repeat the first one
    radius: float = 1.0  # unit of the relative coordinates
    is_whole: bool = False  # each cloud is one group of all its points in their order, around the origin

    @classmethod
    def whole(cls, points_B_N_3: torch.Tensor) -> Groups:
        """Make one group per cloud, of all its points, in absolute coordinates."""
        batch, n, _ = points_B_N_3.shape
        everything_N = torch.arange(n, dtype=torch.int32, device=points_B_N_3.device)
        counts_B_1 = torch.full((batch, 1), n, dtype=torch.int32, device=points_B_N_3.device)
        return cls(points_B_N_3.new_zeros(batch, 1, 3), everything_N.expand(batch, 1, n), counts_B_1, is_whole=True)

    @classmethod
    def balls(cls, points_B_N_3: torch.Tensor, centers_B_M_3: torch.Tensor, radius: float, k: int) -> Groups:
        """Make a group of the first k points within the radius of each center."""
        k, device = min(k, points_B_N_3.shape[1]), points_B_N_3.device
        neighbors, counts = kernels.ball_query(_numpy(points_B_N_3), _numpy(centers_B_M_3), radius, k)
        return cls(centers_B_M_3, torch.from_numpy(neighbors).to(device), torch.from_numpy(counts).to(device), radius)


class GroupMLP(nn.Module):
    """Layers of linear map, batch norm and ReLU on the slots of each group, the last perhaps without; their maximum."""

    def __init__(self, in_features: int, widths: tuple[int, ...], last_relu: bool = True) -> None:
        super().__init__()
        sizes = (3 + in_features, *widths)
        self.linears = nn.ModuleList(nn.Linear(*pair, bias=False) for pair in zip(sizes, widths, strict=False))
        self.norms = nn.ModuleList(BatchNorm(width) for width in widths)
        self.last_relu = last_relu

    def forward(self, points_B_N_3: torch.Tensor, x_B_N_F: torch.Tensor | None, groups: Groups) -> torch.Tensor:
        if points_B_N_3.device.type != "cpu":
            return self.plain(points_B_N_3, x_B_N_F, groups)
        batch, n_groups, _ = groups.centers_B_M_3.shape
        edges = _Edges(groups, points_B_N_3)
        (first, norm), *others = self._layers()
        inputs = points_B_N_3 / groups.radius
        inputs = inputs if x_B_N_F is None else torch.cat([inputs, x_B_N_F], dim=-1)
        y_E_F = linear(inputs.flatten(0, 1), first.weight)
        if not groups.is_whole:  # else around the origin, so that C is zero
            c_G_F = linear(groups.centers_B_M_3.flatten(0, 1), first.weight[:, :3] / -groups.radius)
            y_E_F = _Gather.apply(y_E_F, c_G_F, edges)
        for layer, next_norm in others:
            y_E_F = linear(self._normalize(norm, y_E_F, edges), layer.weight)
            norm = next_norm
        z_G_F = self._normalize(norm, y_E_F, edges, pool=True)
        return (z_G_F.relu() if self.last_relu else z_G_F).view(batch, n_groups, -1)

    def plain(self, points_B_N_3: torch.Tensor, x_B_N_F: torch.Tensor | None, groups: Groups) -> torch.Tensor:
        """Evaluate every slot of every group with torch operations alone."""
        neighbors_B_M_k = groups.neighbors_B_M_k.long()
        slots_B_M_k_F = (take(points_B_N_3, neighbors_B_M_k) - groups.centers_B_M_3[:, :, None]) / groups.radius
        if x_B_N_F is not None:
            slots_B_M_k_F = torch.cat([slots_B_M_k_F, take(x_B_N_F, neighbors_B_M_k)], dim=-1)
        z_S_F = slots_B_M_k_F.flatten(0, 2)
        for depth, (layer, norm) in enumerate(self._layers(), start=1):
            z_S_F = norm(layer(z_S_F))
            if depth < len(self.norms) or self.last_relu:
                z_S_F = z_S_F.relu()
        return z_S_F.view(*neighbors_B_M_k.shape, -1).amax(dim=2)

    def _layers(self) -> list[tuple[nn.Linear, BatchNorm]]:
        linears, norms = cast("list[nn.Linear]", self.linears), cast("list[BatchNorm]", self.norms)
        return list(zip(linears, norms, strict=True))

    def _normalize(self, norm: BatchNorm, y_E_F: torch.Tensor, edges: _Edges, pool: bool = False) -> torch.Tensor:
        if not self.training:
            arrays = y_E_F.detach().numpy(), *norm.scale_and_shift()
            if pool:
                return torch.from_numpy(kernels.normalize_max(*arrays, edges.ends, edges.batch)[0])
            return torch.from_numpy(kernels.normalize(*arrays, edges.cloud_ends))
        out, mean_F, variance_F = _Normalize.apply(y_E_F, norm.weight, norm.bias, norm.eps, edges, pool)
        norm.track(mean_F, variance_F, edges.slots)
        return out


class _Edges:
    """The distinct pairs of a group and one of its points, as :mod:`gpca.encoders.group_kernels` takes them."""

    def __init__(self, groups: Groups, points_B_N_3: torch.Tensor) -> None:
        self.batch, n_points, _ = points_B_N_3.shape
        # All must be contiguous, or numba compiles the kernels a second time.
        neighbors, counts = map(_numpy, (groups.neighbors_B_M_k, groups.counts_B_M))
        self.slots = neighbors.size
        self.point, self.weight, self.ends = kernels.distinct_edges(neighbors, counts, n_points)
        self.cloud_ends = self.ends[:: counts.shape[1]].copy()


class _Gather(torch.autograd.Function):
    """A_j + C_g for every edge."""

    @staticmethod
    def forward(ctx, a_P_F, c_G_F, edges):
        ctx.edges, ctx.n_rows = edges, len(a_P_F)
        y_E_F = np.take(a_P_F.detach().numpy(), edges.point, axis=0)
        y_E_F += np.repeat(c_G_F.detach().numpy(), np.diff(edges.ends), axis=0)
        return torch.from_numpy(y_E_F)

    @staticmethod
    def backward(ctx, grad_y):
        edges, grad_y = ctx.edges, grad_y.contiguous().numpy()
        grads = kernels.gather_backward(grad_y, edges.point, edges.ends, edges.batch, ctx.n_rows)
        return *(torch.from_numpy(grad) for grad in grads), None


class _Normalize(torch.autograd.Function):
    """Batch norm with the statistics of all slots, then ReLU per edge or, with `pool`, the maximum over each group."""

    @staticmethod
    def forward(ctx, y_E_F, gamma_F, beta_F, eps, edges, pool):
        y, gamma, beta = (x.detach().numpy() for x in (y_E_F, gamma_F, beta_F))
        mean, variance = kernels.moments(y, edges.weight, edges.cloud_ends)
        inverse_std = (1.0 / (variance + eps) ** 0.5).astype(y.dtype)
        mean = mean.astype(y.dtype)
        scale = gamma * inverse_std
        shift = beta - scale * mean
        if pool:
            out, kept = kernels.normalize_max(y, scale, shift, edges.ends, edges.batch)
        else:
            out = kept = kernels.normalize(y, scale, shift, edges.cloud_ends)
        ctx.numpy_arrays = (kept, y, edges.weight, mean, inverse_std, gamma, edges.cloud_ends)
        ctx.pool = pool
        mean_F, variance_F = torch.from_numpy(mean), torch.from_numpy(variance.astype(y.dtype))
        ctx.mark_non_differentiable(mean_F, variance_F)
        return torch.from_numpy(out), mean_F, variance_F

    @staticmethod
    def backward(ctx, grad_out, _grad_mean, _grad_variance):
        backward = kernels.normalize_max_backward if ctx.pool else kernels.normalize_backward
        grads = backward(grad_out.contiguous().numpy(), *ctx.numpy_arrays)
        return *(torch.from_numpy(grad) for grad in grads), None, None, None


def farthest_points(points_B_N_3: torch.Tensor, n_centers: int) -> torch.Tensor:
    """Return the indices (B, M) of farthest-point sampling from point 0, which is random (PointNet++, Sec. 3.2)."""
    batch, n, _ = points_B_N_3.shape
    if n <= n_centers:
        return torch.arange(n, device=points_B_N_3.device).expand(batch, n)
    return torch.from_numpy(kernels.farthest_points(_numpy(points_B_N_3), n_centers)).long().to(points_B_N_3.device)


def _numpy(x: torch.Tensor) -> np.ndarray:
    return x.detach().cpu().contiguous().numpy()


def take(x_B_N_F: torch.Tensor, index_B_M: torch.Tensor) -> torch.Tensor:
    batch, n, _ = x_B_N_F.shape
    rows = index_B_M + n * torch.arange(batch, device=x_B_N_F.device).view(-1, *[1] * (index_B_M.ndim - 1))
    return x_B_N_F.reshape(batch * n, -1).index_select(0, rows.reshape(-1)).view(*index_B_M.shape, -1)


# Layers on many points: linear maps by NumPy's product, with the same bytes on every CPU, and given statistics.


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
