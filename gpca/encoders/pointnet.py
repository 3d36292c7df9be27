"""The PointNet family: PointNet with and without transformer networks, PointNet++, and PointNeXt.

All embed clouds (B, N, 3) in the target's frame, in diameters, to (B, d). Without T-Nets, nothing centers, scales or
turns the cloud, which would erase the concepts. `width` is that of the first layer; all others grow with it.
"""

from itertools import pairwise

import torch
from torch import nn

from gpca.encoders.groups import GroupMLP, Groups, ball_query, farthest_points, take
from gpca.encoders.layers import PointLinear, stacked_product

PENALTY = 1e-3  # weight of the distance of the second transform from an orthogonal one, as published
UNIT_SPHERE = 2.0  # diameter of PointNet++'s published clouds
STAGES = 4  # of PointNeXt


class PointNet(nn.Module):
    """Shared layers of 64, 64, 64, 128 and 1024 channels, then max pooling (Qi et al. 2017), without T-Nets."""

    def __init__(self, width: int = 64) -> None:
        super().__init__()
        self.embedding_size = 16 * width
        self.layers = GroupMLP(0, (width, width, width, 2 * width, self.embedding_size))

    def forward(self, points_B_N_3: torch.Tensor) -> torch.Tensor:
        return self.layers(points_B_N_3, None, Groups.whole(points_B_N_3))[:, 0]


class PointNetTNet(nn.Module):
    """The published PointNet: T-Net on the points, layers 64, 64, T-Net on these, layers 64, 128, 1024, maximum.

    The first T-Net starts at the identity, but can learn to turn a cloud and so erase the pose concept. `penalty` is
    0.001 · ‖I - AAᵀ‖² of the feature transforms A, averaged over the last training batch; training adds it to the loss.
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
        x_B_N_F = self.first(stacked_product(points_B_N_3, self.turn_points(points_B_N_3)))
        A_B_F_F = self.turn_features(x_B_N_F)
        self.penalty = PENALTY * _from_orthogonal(A_B_F_F) if self.training else None
        return self.last(stacked_product(x_B_N_F, A_B_F_F))


class TNet(nn.Module):
    """A small PointNet that predicts a matrix (F, F) for each cloud's points or features; the identity at first."""

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
        return self.matrix(self.whole(self.points(x_B_N_F))).view(-1, self.features, self.features)


class Pooled(nn.Module):
    """Layers of linear map, batch norm and ReLU on points with `inputs` numbers each, and the maximum over points."""

    def __init__(self, inputs: int, widths: tuple[int, ...]) -> None:
        super().__init__()
        self.layers = GroupMLP(inputs - 3, widths)

    def forward(self, x_B_N_F: torch.Tensor) -> torch.Tensor:
        # GroupMLP takes three numbers as coordinates, which it treats like the others when the group is the cloud.
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
        x_P_F = x_I.flatten(0, -2)
        for linear, norm in zip(self.linears, self.norms, strict=True):
            x_P_F = norm(linear(x_P_F)).relu()
        return x_P_F.view(*x_I.shape[:-1], -1)


def _from_orthogonal(A_B_F_F: torch.Tensor) -> torch.Tensor:
    """Mean over matrices of the squared Frobenius distance of AAᵀ from the identity."""
    apart_B_F_F = stacked_product(A_B_F_F, A_B_F_F.mT) - torch.eye(A_B_F_F.shape[-1], device=A_B_F_F.device)
    return apart_B_F_F.square().sum(dim=(1, 2)).mean()


class PointNet2(nn.Module):
    """PointNet++ with single-scale grouping (Qi et al. 2017b): set abstraction at 256 and 64 centroids, then the whole.

    The published network has 512 and 128 centroids for clouds of 1024 points; here at most half of the points are
    centroids of the first level. Its radii of 0.2 and 0.4 are for clouds of diameter 2, so here 0.1 and 0.2.

    Two inputs differ from the published ones, unless `as_published`. Absolute coordinates are features too (as normals
    are in the published network): relative coordinates alone hide where a ball lies until the last level. And relative
    coordinates are divided by the radius: ten times smaller than the absolute ones, they would be learned late.
    """

    def __init__(
        self,
        width: int = 64,
        centroids: int = 256,
        radius: float = 0.1,
        neighbours: int = 32,
        as_published: bool = False,
    ) -> None:
        super().__init__()
        w = width
        self.embedding_size, self.centroids, self.as_published = 16 * w, centroids, as_published
        self.balls = ((radius, neighbours), (2 * radius, 2 * neighbours))
        first = GroupMLP(0 if as_published else 3, (w, w, 2 * w))
        self.levels = nn.ModuleList([first, GroupMLP(2 * w, (2 * w, 2 * w, 4 * w))])
        self.whole = GroupMLP(4 * w, (4 * w, 8 * w, self.embedding_size))

    def forward(self, points_B_N_3: torch.Tensor) -> torch.Tensor:
        scale = UNIT_SPHERE if self.as_published else 1.0
        points_B_N_3 = scale * points_B_N_3
        x_B_N_F = None if self.as_published else points_B_N_3
        centroids = min(self.centroids, max(1, points_B_N_3.shape[1] // 2))
        for layers, (radius, neighbours) in zip(self.levels, self.balls, strict=True):
            centers_B_M_3 = take(points_B_N_3, farthest_points(points_B_N_3, centroids))
            around = ball_query(points_B_N_3, centers_B_M_3, scale * radius, neighbours)
            groups = Groups(centers_B_M_3, *around, 1.0 if self.as_published else radius)
            x_B_N_F = layers(points_B_N_3, x_B_N_F, groups)
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
        around = ball_query(points_B_N_3, centers_B_M_3, self.radius, self.neighbors)
        pooled_B_M_F = self.layers(points_B_N_3, x_B_N_F, Groups(centers_B_M_3, *around, self.radius))
        return centers_B_M_3, (pooled_B_M_F + self.skip(take(x_B_N_F, chosen_B_M))).relu()


class PointNeXt(nn.Module):
    """PointNeXt-S for classification (Qian et al. 2022): a stem, four stages of set abstraction, the whole cloud.

    Each stage halves the points and doubles the channels. The first radius of 0.15 is for clouds of diameter 2, so here
    0.075 diameters, growing by 1.5 with each stage. As published, absolute coordinates enter the stem.
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
