"""The PointNet family: PointNet without transformer networks, PointNet++, and PointNeXt."""

import torch
from torch import nn

from gpca.encoders.groups import GroupMLP, Groups, PointLinear, farthest_points, take

STAGES = 4  # of PointNeXt


class PointNet(nn.Module):
    """Shared layers of 64, 64, 64, 128 and 1024 channels, then max pooling (Qi et al. 2017), without T-Nets."""

    def __init__(self, width: int = 64) -> None:
        super().__init__()
        self.embedding_size = 16 * width
        self.layers = GroupMLP(0, (width, width, width, 2 * width, self.embedding_size))

    def forward(self, points_B_N_3: torch.Tensor) -> torch.Tensor:
        return self.layers(points_B_N_3, None, Groups.whole(points_B_N_3))[:, 0]


class PointNet2(nn.Module):
    """PointNet++ with single-scale grouping (Qi et al. 2017b): set abstraction at 256 and 64 centroids, then the whole.

    The published radii of 0.2 and 0.4 are for clouds of diameter 2, so here 0.1 and 0.2, and at most half of the points
    are centroids. Absolute coordinates are features too; relative ones, else learned late, are divided by the radius.
    """

    def __init__(self, width: int = 64, centroids: int = 256, radius: float = 0.1, neighbours: int = 32) -> None:
        super().__init__()
        w = width
        self.embedding_size, self.centroids = 16 * w, centroids
        self.balls = ((radius, neighbours), (2 * radius, 2 * neighbours))
        self.levels = nn.ModuleList([GroupMLP(3, (w, w, 2 * w)), GroupMLP(2 * w, (2 * w, 2 * w, 4 * w))])
        self.whole = GroupMLP(4 * w, (4 * w, 8 * w, self.embedding_size))

    def forward(self, points_B_N_3: torch.Tensor) -> torch.Tensor:
        x_B_N_F = points_B_N_3
        centroids = min(self.centroids, max(1, points_B_N_3.shape[1] // 2))
        for layers, (radius, neighbours) in zip(self.levels, self.balls, strict=True):
            centers_B_M_3 = take(points_B_N_3, farthest_points(points_B_N_3, centroids))
            x_B_N_F = layers(points_B_N_3, x_B_N_F, Groups.balls(points_B_N_3, centers_B_M_3, radius, neighbours))
            points_B_N_3, centroids = centers_B_M_3, max(1, centroids // 4)
        return self.whole(points_B_N_3, x_B_N_F, Groups.whole(points_B_N_3))[:, 0]


class SetAbstraction(nn.Module):
    """A stage of PointNeXt-S: half of the points as centroids, two layers on each ball, maximum, residual."""

    def __init__(self, in_features: int, out_features: int, radius: float, neighbors: int) -> None:
        super().__init__()
        self.radius, self.neighbors = radius, neighbors
        self.layers = GroupMLP(in_features, (out_features // 2, out_features), last_relu=False)
        self.skip = PointLinear(in_features, out_features)

    def forward(self, points_B_N_3: torch.Tensor, x_B_N_F: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        chosen_B_M = farthest_points(points_B_N_3, max(1, points_B_N_3.shape[1] // 2))
        centers_B_M_3 = take(points_B_N_3, chosen_B_M)
        balls = Groups.balls(points_B_N_3, centers_B_M_3, self.radius, self.neighbors)
        pooled_B_M_F = self.layers(points_B_N_3, x_B_N_F, balls)
        return centers_B_M_3, (pooled_B_M_F + self.skip(take(x_B_N_F, chosen_B_M))).relu()


class PointNeXt(nn.Module):
    """PointNeXt-S for classification (Qian et al. 2022): a stem, four stages of set abstraction, the whole cloud.

    Each stage halves the points and doubles the channels. The first radius of 0.15 is for clouds of diameter 2, so here
    0.075 diameters, growing by 1.5 with each stage.
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
        x_B_N_F = self.stem(points_B_N_3)
        for stage in self.stages:
            points_B_N_3, x_B_N_F = stage(points_B_N_3, x_B_N_F)
        return self.whole(points_B_N_3, x_B_N_F, Groups.whole(points_B_N_3))[:, 0]
