"""PointNet++ with single-scale grouping (Qi et al. 2017b): PointNets on balls, on balls of balls, on the whole."""

from __future__ import annotations

import torch
from torch import nn

from gpca.encoders.group_mlp import GroupMLP
from gpca.encoders.grouping import Groups, ball_query, farthest_points, take

UNIT_SPHERE = 2.0  # diameter of the published clouds


class PointNet2(nn.Module):
    """Set abstraction at 256 and 64 centroids, then of the whole cloud: the published network for ModelNet40.

    It has 512 and 128 centroids for clouds of 1024 points; with 512 points the shares are kept, and so they are in
    smaller clouds: at most half of the points are centroids of the first level. Its radii of 0.2 and 0.4 are for clouds
    in the unit sphere, of diameter 2; here the object's diameter is 1, so they are 0.1 and 0.2.

    A ball's points are given relative to its centroid, as published, so the first two levels would not see where on
    the object a ball lies before the last one tells them. Therefore the points' own coordinates go in as features too,
    as normals do in the published network. Relative coordinates are divided by the radius, which the published network
    does not do: beside coordinates ten times as large, training would start nearly blind to the shape within a ball.
    `as_published` does neither: points within a ball have nothing but coordinates relative to its centroid, and all
    coordinates are those of a cloud in the unit sphere.

    Args:
        width: that of the first layer, 64 as published; all others grow with it.
        centroids: how many the first level has, at most; the second has a quarter of its number.
        radius: that of the first level's balls, in units of the object's diameter; the second's is twice as large.
        neighbours: points of a ball on the first level, at most; twice as many on the second.
        as_published: whether inputs are the published ones.

    Attributes:
        embedding_size: d = 16 · width.
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
        self.embedding_size = 16 * w
        self.centroids = centroids
        self.balls = ((radius, neighbours), (2 * radius, 2 * neighbours))
        self.as_published = as_published
        first = GroupMLP(0 if as_published else 3, (w, w, 2 * w))
        self.levels = nn.ModuleList([first, GroupMLP(2 * w, (2 * w, 2 * w, 4 * w))])
        self.whole = GroupMLP(4 * w, (4 * w, 8 * w, self.embedding_size))

    def forward(self, points_B_N_3: torch.Tensor) -> torch.Tensor:
        """Return embeddings (B, d) of clouds in the target's frame, in units of the object's diameter."""
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
