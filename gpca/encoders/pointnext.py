"""PointNeXt-S (Qian et al. 2022): PointNet++ with residual set abstraction and radii as units of length."""

from __future__ import annotations

import torch
from torch import nn

from gpca.encoders.group_mlp import GroupMLP
from gpca.encoders.grouping import Groups, ball_query, farthest_points, take
from gpca.encoders.layers import PointLinear

STAGES = 4


class SetAbstraction(nn.Module):
    """Half of the points as centroids; two layers on each one's ball, maximum, and the centroid's own features added.

    Relative coordinates are divided by the radius. Of variants S, B, L and XL only S adds the residual here; the others
    have inverted residual blocks after each stage, of which S has none.
    """

    def __init__(self, in_features: int, out_features: int, radius: float, neighbors: int) -> None:
        super().__init__()
        self.radius = radius
        self.neighbors = neighbors
        self.layers = GroupMLP(in_features, (out_features // 2, out_features), last_relu=False)
        self.skip = PointLinear(in_features, out_features)

    def forward(self, points_B_N_3: torch.Tensor, x_B_N_F: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the centroids (B, M, 3) and their features (B, M, F_out)."""
        chosen_B_M = farthest_points(points_B_N_3, max(1, points_B_N_3.shape[1] // 2))
        centers_B_M_3 = take(points_B_N_3, chosen_B_M)
        around = ball_query(points_B_N_3, centers_B_M_3, self.radius, self.neighbors)
        pooled_B_M_F = self.layers(points_B_N_3, x_B_N_F, Groups(centers_B_M_3, *around, self.radius))
        return centers_B_M_3, (pooled_B_M_F + self.skip(take(x_B_N_F, chosen_B_M))).relu()


class PointNeXt(nn.Module):
    """A linear stem of 32 channels, four stages of half the points and twice the channels, and the whole cloud.

    Variant S for classification. Its first radius of 0.15 is for clouds in the unit sphere, of diameter 2; here the
    object's diameter is 1, so it is 0.075, growing by 1.5 with each stage. As published, the points' coordinates are
    the features that enter the stem, so every stage sees the frame and not only the shape within its balls.

    Args:
        width: that of the stem, 32 as published.
        radius: that of the first stage's balls, in units of the object's diameter.
        neighbours: points of a ball, at most.

    Attributes:
        embedding_size: d = 16 · width.
    """

    def __init__(self, width: int = 32, radius: float = 0.075, neighbours: int = 32) -> None:
        super().__init__()
        self.embedding_size = d = width * 2**STAGES
        self.stem = PointLinear(3, width)
        self.stages = nn.ModuleList(
            SetAbstraction(width * 2**stage, width * 2 ** (stage + 1), radius * 1.5**stage, neighbours)
            for stage in range(STAGES)
        )
        self.whole = GroupMLP(d, (d, d))

    def forward(self, points_B_N_3: torch.Tensor) -> torch.Tensor:
        """Return embeddings (B, d) of clouds in the target's frame, in units of the object's diameter."""
        x_B_N_F = self.stem(points_B_N_3)
        for stage in self.stages:
            points_B_N_3, x_B_N_F = stage(points_B_N_3, x_B_N_F)
        return self.whole(points_B_N_3, x_B_N_F, Groups.whole(points_B_N_3))[:, 0]
