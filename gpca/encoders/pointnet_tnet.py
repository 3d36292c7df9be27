"""PointNet with its two transformer networks (Qi et al. 2017), which turn the points and then their features."""

from __future__ import annotations

from itertools import pairwise

import torch
from torch import nn

from gpca.encoders.group_mlp import GroupMLP
from gpca.encoders.grouping import Groups
from gpca.encoders.layers import PointLinear, stacked_product

PENALTY = 1e-3  # weight of the distance of the second transform from an orthogonal one, as published


class PointNetTNet(nn.Module):
    """The published network: T-Net on the points, layers of 64 and 64, T-Net on these, layers of 64, 128 and 1024, max.

    The first T-Net can turn a cloud into a pose of its own choice, and so erase the pose concept; it starts at the
    identity. Training adds :attr:`penalty` to the loss.

    Args:
        width: that of the first layer, 64 as published; the others grow with it.

    Attributes:
        embedding_size: d = 16 · width.
        penalty: 0.001 · ‖I - AAᵀ‖² of the feature transforms A, its mean over the clouds that training saw last.
    """

    def __init__(self, width: int = 64) -> None:
        super().__init__()
        self.embedding_size = 16 * width
        self.turn_points = TNet(3, width)
        self.first = PointLayers((3, width, width))
        self.turn_features = TNet(width, width)
        self.last = Pooled(width, (width, 2 * width, self.embedding_size))
        self.penalty: torch.Tensor | None = None

    def forward(self, points_B_N_3: torch.Tensor) -> torch.Tensor:
        """Return embeddings (B, d) of clouds in the target's frame, in units of the object's diameter."""
        x_B_N_F = self.first(stacked_product(points_B_N_3, self.turn_points(points_B_N_3)))
        A_B_F_F = self.turn_features(x_B_N_F)
        self.penalty = PENALTY * _from_orthogonal(A_B_F_F) if self.training else None
        return self.last(stacked_product(x_B_N_F, A_B_F_F))


class TNet(nn.Module):
    """A small PointNet that gives each cloud a matrix (F, F) to turn its points or features; the identity at first."""

    def __init__(self, features: int, width: int) -> None:
        super().__init__()
        self.features = features
        self.points = Pooled(features, (width, 2 * width, 16 * width))
        self.whole = PointLayers((16 * width, 8 * width, 4 * width))
        self.matrix = PointLinear(4 * width, features**2)
        nn.init.zeros_(self.matrix.weight)
        with torch.no_grad():
            self.matrix.bias.copy_(torch.eye(features).flatten())

    def forward(self, x_B_N_F: torch.Tensor) -> torch.Tensor:
        """Return the matrix (B, F, F) of each cloud."""
        return self.matrix(self.whole(self.points(x_B_N_F))).view(-1, self.features, self.features)


class Pooled(nn.Module):
    """Layers of linear map, batch norm and ReLU on points of so many numbers, and the maximum over the points."""

    def __init__(self, inputs: int, widths: tuple[int, ...]) -> None:
        super().__init__()
        self.layers = GroupMLP(inputs - 3, widths)

    def forward(self, x_B_N_F: torch.Tensor) -> torch.Tensor:
        """Map features (B, N, F) to the whole cloud's (B, F_out)."""
        # To the layers, three of the numbers are coordinates, which a whole cloud does not treat in another way.
        three_B_N_3, others_B_N_F = x_B_N_F[..., :3].contiguous(), x_B_N_F[..., 3:].contiguous()
        others = others_B_N_F if others_B_N_F.shape[-1] else None
        return self.layers(three_B_N_3, others, Groups.whole(three_B_N_3))[:, 0]


class PointLayers(nn.Module):
    """Layers of linear map, batch norm and ReLU on every point; `sizes` are the inputs and the outputs of each."""

    def __init__(self, sizes: tuple[int, ...]) -> None:
        super().__init__()
        self.linears = nn.ModuleList(PointLinear(*pair, bias=False) for pair in pairwise(sizes))
        self.norms = nn.ModuleList(nn.BatchNorm1d(size) for size in sizes[1:])

    def forward(self, x_I: torch.Tensor) -> torch.Tensor:
        """Map inputs (…, I) to (…, O)."""
        x_P_F = x_I.flatten(0, -2)
        for linear, norm in zip(self.linears, self.norms, strict=True):
            x_P_F = norm(linear(x_P_F)).relu()
        return x_P_F.view(*x_I.shape[:-1], -1)


def _from_orthogonal(A_B_F_F: torch.Tensor) -> torch.Tensor:
    """Return the mean over matrices of the squared Frobenius distance of AAᵀ from the identity."""
    apart_B_F_F = stacked_product(A_B_F_F, A_B_F_F.mT) - torch.eye(A_B_F_F.shape[-1], device=A_B_F_F.device)
    return apart_B_F_F.square().sum(dim=(1, 2)).mean()
