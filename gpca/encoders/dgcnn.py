"""DGCNN (Wang et al. 2019), the encoder of GP-CA."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import nn

from gpca.encoders.edge_conv import NEGATIVE_SLOPE, EdgeConv
from gpca.encoders.layers import PointLinear


class DGCNN(nn.Module):
    """Four EdgeConvs (64, 64, 128, 256) on dynamic graphs, a point-wise layer, max and mean pooling.

    The published widths; the point-wise layer has 256 channels here (1024 in the ModelNet40 network), which keeps
    it to half of the arithmetic. The cloud is used as it is: no centering, scaling or spatial transformer, which would
    erase the concepts.

    Args:
        k: neighbors per point, the point itself included.
        point_features: width of the point-wise layer.
        widths: of the EdgeConvs.
        inputs: numbers of a point; its coordinates, unless there are more.

    Attributes:
        embedding_size: d = 2 · point_features.
    """

    def __init__(
        self, k: int = 20, point_features: int = 256, widths: Sequence[int] = (64, 64, 128, 256), inputs: int = 3
    ) -> None:
        super().__init__()
        self.edge_convs = nn.ModuleList(
            EdgeConv(before, after, k) for before, after in zip((inputs, *widths[:-1]), widths, strict=True)
        )
        self.point_layer = PointLinear(sum(widths), point_features, bias=False)
        self.point_norm = nn.BatchNorm1d(point_features)
        self.embedding_size = 2 * point_features

    def forward(self, clouds: torch.Tensor | Sequence[torch.Tensor]) -> torch.Tensor:
        """Return embeddings (B, d) of clouds in the target's frame, in units of the object's diameter.

        Args:
            clouds: (B, N, 3), or B of them (N, 3) of unlike sizes.
        """
        sizes = None if isinstance(clouds, torch.Tensor) else [len(cloud) for cloud in clouds]
        x_B_N_F = clouds if isinstance(clouds, torch.Tensor) else torch.cat(list(clouds))[None]
        batch, n, _ = x_B_N_F.shape
        features = []
        for edge_conv in self.edge_convs:
            x_B_N_F = edge_conv(x_B_N_F, sizes)
            features.append(x_B_N_F)
        x_P_F = self.point_norm(self.point_layer(torch.cat(features, dim=-1).view(batch * n, -1)))
        x_B_N_F = nn.functional.leaky_relu(x_P_F, NEGATIVE_SLOPE).view(batch, n, -1)
        parts = [x_B_N_F] if sizes is None else x_B_N_F.split(sizes, dim=1)
        return torch.cat([torch.cat([part.max(dim=1).values, part.mean(dim=1)], dim=-1) for part in parts])
