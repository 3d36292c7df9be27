"""DGCNN (Wang et al. 2019), the encoder of GP-CA."""

from __future__ import annotations

import torch
from torch import nn

from gpca.encoders.edge_conv import NEGATIVE_SLOPE, EdgeConv
from gpca.encoders.linear import PointLinear


class DGCNN(nn.Module):
    """Four EdgeConvs (64, 64, 128, 256) on dynamic graphs, a point-wise layer, max and mean pooling.

    The published widths; the point-wise layer has 256 channels here (1024 in the ModelNet40 network), which keeps
    it to half of the arithmetic. The cloud is used as it is: no centring, scaling or spatial transformer, which would
    erase the concepts.

    Args:
        k: neighbours per point, the point itself included.
        point_features: width of the point-wise layer.

    Attributes:
        embedding_size: d = 2 · point_features.
    """

    def __init__(self, k: int = 20, point_features: int = 256) -> None:
        super().__init__()
        widths = (64, 64, 128, 256)
        self.edge_convs = nn.ModuleList(
            EdgeConv(inputs, outputs, k) for inputs, outputs in zip((3, *widths[:-1]), widths, strict=True)
        )
        self.point_layer = PointLinear(sum(widths), point_features, bias=False)
        self.point_norm = nn.BatchNorm1d(point_features)
        self.embedding_size = 2 * point_features

    def forward(self, points_B_N_3: torch.Tensor) -> torch.Tensor:
        """Return embeddings (B, d) of clouds in the target's frame, in units of the object's diameter."""
        batch, n, _ = points_B_N_3.shape
        features = []
        x_B_N_F = points_B_N_3
        for edge_conv in self.edge_convs:
            x_B_N_F = edge_conv(x_B_N_F)
            features.append(x_B_N_F)
        x_P_F = self.point_norm(self.point_layer(torch.cat(features, dim=-1).view(batch * n, -1)))
        x_B_N_F = nn.functional.leaky_relu(x_P_F, NEGATIVE_SLOPE).view(batch, n, -1)
        return torch.cat([x_B_N_F.max(dim=1).values, x_B_N_F.mean(dim=1)], dim=-1)
