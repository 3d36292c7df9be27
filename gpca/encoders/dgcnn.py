"""DGCNN (Wang et al. 2019), the encoder of GP-CA; its EdgeConv is evaluated per point instead of per edge.

The linear layer W = [W1 | W2] on ``[x_j - x_i ; x_i]`` splits into y_ij = W1 x_j + (W2 - W1) x_i = A_j + C_i, so the
product runs over N points, not N·k edges. Batch normalization is affine and LeakyReLU monotone, hence

    max_j act(γ (y_ij - μ)/σ + β) = act(γ (ext_j y_ij - μ)/σ + β),  ext = max where γ >= 0, min where γ < 0.

μ and σ² are those of all B·N·k edges. ``tests/encoders/per_edge.py`` is the per-edge form.
"""

from collections.abc import Sequence

import numpy as np
import torch
from torch import nn

from gpca.encoders import edge_kernels
from gpca.encoders.groups import BatchNorm, PointLinear, linear
from gpca.encoders.inference import NEGATIVE_SLOPE, WIDTHS, embed_clouds, nearest

CHANNELS, MOTION = 7, 5  # numbers per point of a pair, and of ICP's motion when all of it is given
SCALE = 0.1  # of all channels but the coordinates, so that neighbors in the first graph are neighbors on the surface


class DGCNN(nn.Module):
    """Four EdgeConvs (64, 64, 128, 256) on dynamic graphs, a point-wise layer, max and mean pooling.

    The point-wise layer has 256 channels (published: 1024), which halves the arithmetic. The cloud is neither centered
    nor scaled nor turned, which would erase the concepts. `k` counts the point itself; `inputs` are numbers per point.
    """

    def __init__(self, k: int = 20, point_features: int = 256, widths: Sequence[int] = WIDTHS, inputs: int = 3) -> None:
        super().__init__()
        self.k = k
        self.edge_convs = nn.ModuleList(
            EdgeConv(before, after, k) for before, after in zip((inputs, *widths[:-1]), widths, strict=True)
        )
        self.point_layer = PointLinear(sum(widths), point_features, bias=False)
        self.point_norm = nn.BatchNorm1d(point_features)
        self.embedding_size = 2 * point_features

    def forward(self, clouds: torch.Tensor | Sequence[torch.Tensor]) -> torch.Tensor:
        """Embed clouds (B, N, 3), or B clouds (N, 3) of any sizes, in the target's frame and in diameters: (B, d)."""
        if isinstance(clouds, torch.Tensor):
            x_B_N_F, sizes = clouds, None
        else:
            x_B_N_F, sizes = torch.cat(list(clouds))[None], [len(cloud) for cloud in clouds]
        if x_B_N_F.device.type == "cpu" and not self.training:
            weights = {name: part.detach().numpy() for name, part in self.state_dict().items()}
            return torch.from_numpy(embed_clouds(weights, self.k, x_B_N_F.detach().contiguous().numpy(), sizes))
        return self.by_layers(x_B_N_F, sizes)

    def by_layers(self, x_B_N_F: torch.Tensor, sizes: Sequence[int] | None = None) -> torch.Tensor:
        """Embed clouds (B, N, 3), or with `sizes` those in one row, by torch's layers."""
        batch, n, _ = x_B_N_F.shape
        features = []
        for edge_conv in self.edge_convs:
            x_B_N_F = edge_conv(x_B_N_F, sizes)
            features.append(x_B_N_F)
        x_P_F = self.point_norm(self.point_layer(torch.cat(features, dim=-1).view(batch * n, -1)))
        x_B_N_F = nn.functional.leaky_relu(x_P_F, NEGATIVE_SLOPE).view(batch, n, -1)
        parts = [x_B_N_F] if sizes is None else x_B_N_F.split(sizes, dim=1)
        return torch.cat([torch.cat([part.max(dim=1).values, part.mean(dim=1)], dim=-1) for part in parts])


class PairDGCNN(nn.Module):
    """DGCNN on the points of both clouds of a registered pair; the `motion` numbers of ICP's motion follow."""

    def __init__(
        self, k: int = 10, widths: tuple[int, ...] = (32, 32, 64), point_features: int = 64, motion: int = MOTION
    ) -> None:
        super().__init__()
        self.dgcnn = DGCNN(k, point_features, widths, CHANNELS + 1)
        self.embedding_size = self.dgcnn.embedding_size + motion

    def forward(self, pairs: tuple[torch.Tensor, torch.Tensor]) -> torch.Tensor:
        """Embed points (B, 2, T, `CHANNELS`) of the observed cloud and the model, and motions (B, M): (B, d)."""
        points_B_2_T_F, motion_B_M = pairs
        batch, _, count, _ = points_B_2_T_F.shape
        side_2 = points_B_2_T_F.new_tensor([1.0, -1.0])
        side_B_2_T_1 = side_2[None, :, None, None].expand(batch, 2, count, 1)
        others_B_2_T_G = SCALE * torch.cat([points_B_2_T_F[..., 3:], side_B_2_T_1], dim=-1)
        joined_B_2_T_F = torch.cat([points_B_2_T_F[..., :3], others_B_2_T_G], dim=-1)
        return torch.cat([self.dgcnn(joined_B_2_T_F.flatten(1, 2)), motion_B_M], dim=1)


class EdgeConv(nn.Module):
    """Linear map W (F_out, 2·F_in) on edges, batch norm over edges, LeakyReLU(0.2), maximum over the k neighbors."""

    def __init__(self, in_features: int, out_features: int, k: int) -> None:
        super().__init__()
        self.k = k
        self.weight = nn.Parameter(torch.empty(out_features, 2 * in_features))
        nn.init.kaiming_uniform_(self.weight, a=5**0.5)
        self.norm = BatchNorm(out_features)

    def forward(self, x_B_N_F: torch.Tensor, sizes: Sequence[int] | None = None) -> torch.Tensor:
        """Map features (B, N, F_in) to (B, N, F_out) on the graph of the input features; see :func:`knn_indices`."""
        neighbors_B_N_k = knn_indices(x_B_N_F, self.k, sizes)
        w1, w2 = self.weight.chunk(2, dim=1)
        ac_B_N_2F = linear(x_B_N_F, torch.cat([w1, w2 - w1]))
        if ac_B_N_2F.device.type != "cpu" or not self.training:
            return _edge_max_plain(ac_B_N_2F, neighbors_B_N_k, self.norm)
        out_B_N_F, mean_F, variance_F = _EdgeMax.apply(
            ac_B_N_2F, neighbors_B_N_k, self.norm.weight, self.norm.bias, self.norm.eps
        )
        self.norm.track(mean_F, variance_F, neighbors_B_N_k.numel())
        return out_B_N_F


def knn_indices(x_B_N_F: torch.Tensor, k: int, sizes: Sequence[int] | None = None) -> torch.Tensor:
    """Return the indices (B, N, k) of :func:`gpca.encoders.inference.nearest`."""
    if x_B_N_F.device.type == "cpu":
        return torch.from_numpy(nearest(x_B_N_F.detach().contiguous().numpy(), k, sizes))
    if sizes is not None:
        clouds = zip(x_B_N_F.split(list(sizes), 1), np.cumsum([0, *sizes[:-1]]), strict=True)
        return torch.cat([knn_indices(x_1_n_F, k) + int(start) for x_1_n_F, start in clouds], dim=1)
    x_B_N_F = x_B_N_F.detach()
    columns_B_N = (x_B_N_F * x_B_N_F).sum(-1)
    distances_B_N_N = columns_B_N[:, None] - 2 * x_B_N_F @ x_B_N_F.mT  # less |x_i|², the same for a whole row
    return distances_B_N_N.topk(k, dim=-1, largest=False, sorted=False).indices


class _EdgeMax(torch.autograd.Function):
    """Batch-normalized, activated maximum over neighbors with the exact statistics of all edges (CPU)."""

    @staticmethod
    def forward(ctx, ac_B_N_2F, neighbors_B_N_k, gamma_F, beta_F, eps):
        n_edges = neighbors_B_N_k.numel()
        ac, neighbors, gamma, beta = _numpy(ac_B_N_2F, neighbors_B_N_k, gamma_F, beta_F)
        extreme, extreme_at, edge_sums, mean, variance = edge_kernels.gather_extreme_and_sums(ac, neighbors, gamma)
        inverse_std = (1.0 / (variance + eps) ** 0.5).astype(ac.dtype)
        mean = mean.astype(ac.dtype)
        out = edge_kernels.normalize_activate(extreme, mean, inverse_std, gamma, beta, NEGATIVE_SLOPE)
        ctx.numpy_arrays = (ac, neighbors, extreme, extreme_at, edge_sums, mean, inverse_std, gamma, out, n_edges)
        mean_F, variance_F = torch.from_numpy(mean), torch.from_numpy(variance.astype(ac.dtype))
        ctx.mark_non_differentiable(mean_F, variance_F)
        return torch.from_numpy(out), mean_F, variance_F

    @staticmethod
    def backward(ctx, grad_out_B_N_F, _grad_mean, _grad_variance):
        (grad_out,) = _numpy(grad_out_B_N_F)
        grad_ac, grad_gamma, grad_beta = edge_kernels.edge_max_backward(grad_out, *ctx.numpy_arrays, NEGATIVE_SLOPE)
        return torch.from_numpy(grad_ac), None, torch.from_numpy(grad_gamma), torch.from_numpy(grad_beta), None


def _edge_max_plain(ac_B_N_2F: torch.Tensor, neighbors_B_N_k: torch.Tensor, norm: nn.BatchNorm1d) -> torch.Tensor:
    """Evaluate the layer with torch operations, on a GPU or of a trained layer."""
    a_B_N_F, c_B_N_F = ac_B_N_2F.chunk(2, dim=-1)
    batch, n, _ = neighbors_B_N_k.shape
    rows_B_N_k = neighbors_B_N_k + n * torch.arange(batch, device=ac_B_N_2F.device)[:, None, None]
    # Not `take`: on a GPU, the gradient of index_select varies from run to run.
    y_B_N_k_F = a_B_N_F.flatten(0, 1)[rows_B_N_k] + c_B_N_F[:, :, None]
    activated_E_F = nn.functional.leaky_relu(norm(y_B_N_k_F.flatten(0, 2)), NEGATIVE_SLOPE)
    return activated_E_F.view_as(y_B_N_k_F).amax(dim=2)


def _numpy(*tensors: torch.Tensor):
    return tuple(tensor.detach().contiguous().numpy() for tensor in tensors)
