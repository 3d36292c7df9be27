"""Encoders of a registered pair: both clouds at once, each point described by how it lies to the other cloud.

Both take the features of :func:`gpca.features.distances.describe_points`, and the motion of ICP, which they hand on
beside their own features of the points.
"""

from __future__ import annotations

import torch
from torch import nn

from gpca.encoders.dgcnn import DGCNN
from gpca.encoders.edge_conv import NEGATIVE_SLOPE
from gpca.encoders.layers import PointLinear, stacked_product

CHANNELS, MOTION = 7, 5  # numbers of a point, and of the motion where all of it is told
SCALE = 0.1  # of all but the coordinates, so that neighbors in the first graph are neighbors on the surface


class PairDGCNN(nn.Module):
    """DGCNN on the points of both clouds together, each with its membership (±1) as one more channel.

    Args:
        k: neighbors per point, of either cloud.
        widths: of the EdgeConvs.
        point_features: width of the point-wise layer.
        motion: numbers of the motion that it is told.
    """

    def __init__(
        self, k: int = 10, widths: tuple[int, ...] = (32, 32, 64), point_features: int = 64, motion: int = MOTION
    ) -> None:
        super().__init__()
        self.dgcnn = DGCNN(k, point_features, widths, CHANNELS + 1)
        self.embedding_size = self.dgcnn.embedding_size + motion

    def forward(self, pairs: tuple[torch.Tensor, torch.Tensor]) -> torch.Tensor:
        """Return embeddings (B, d).

        Args:
            pairs: points (B, 2, T, `CHANNELS`) of the observed cloud and of the model, and motions (B, M).
        """
        points_B_2_T_F, motion_B_M = pairs
        batch, _, count, _ = points_B_2_T_F.shape
        side_2 = points_B_2_T_F.new_tensor([1.0, -1.0])
        side_B_2_T_1 = side_2[None, :, None, None].expand(batch, 2, count, 1)
        others_B_2_T_G = SCALE * torch.cat([points_B_2_T_F[..., 3:], side_B_2_T_1], dim=-1)
        joined_B_2_T_F = torch.cat([points_B_2_T_F[..., :3], others_B_2_T_G], dim=-1)
        return torch.cat([self.dgcnn(joined_B_2_T_F.flatten(1, 2)), motion_B_M], dim=1)


class PairAttention(nn.Module):
    """Two clouds through shared weights: a layer on every point, cross-attention to the other cloud, another layer.

    Args:
        width: of all layers.
        motion: numbers of the motion that it is told.
    """

    def __init__(self, width: int = 64, motion: int = MOTION) -> None:
        super().__init__()
        self.first = _PointLayer(CHANNELS, width)
        self.second = _PointLayer(width, width)
        self.query, self.key, self.value = (PointLinear(width, width, bias=False) for _ in range(3))
        self.last = _PointLayer(2 * width, width)
        self.embedding_size = 4 * width + motion

    def forward(self, pairs: tuple[torch.Tensor, torch.Tensor]) -> torch.Tensor:
        """Return embeddings (B, d): maximum and mean of either cloud, and the motion; see :class:`PairDGCNN`."""
        points_B_2_T_F, motion_B_M = pairs
        x_B_2_T_W = self.second(self.first(points_B_2_T_F))
        other_B_2_T_W = x_B_2_T_W.flip(1)
        scores_B_2_T_T = stacked_product(self.query(x_B_2_T_W), self.key(other_B_2_T_W).mT)
        weights_B_2_T_T = (scores_B_2_T_T * x_B_2_T_W.shape[-1] ** -0.5).softmax(dim=-1)
        seen_B_2_T_W = stacked_product(weights_B_2_T_T, self.value(other_B_2_T_W))
        y_B_2_T_W = self.last(torch.cat([x_B_2_T_W, seen_B_2_T_W], dim=-1))
        pooled_B_2_V = torch.cat([y_B_2_T_W.amax(dim=2), y_B_2_T_W.mean(dim=2)], dim=-1)
        return torch.cat([pooled_B_2_V.flatten(1), motion_B_M], dim=1)


class _PointLayer(nn.Module):
    """A linear layer on every point, batch norm and LeakyReLU."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.linear = PointLinear(inputs, outputs, bias=False)
        self.norm = nn.BatchNorm1d(outputs)

    def forward(self, x_I: torch.Tensor) -> torch.Tensor:
        y_P_O = self.norm(self.linear(x_I).flatten(0, -2))
        return nn.functional.leaky_relu(y_P_O, NEGATIVE_SLOPE).view(*x_I.shape[:-1], -1)


PAIR_ENCODERS = {"pair_dgcnn": PairDGCNN, "pair_attention": PairAttention}
