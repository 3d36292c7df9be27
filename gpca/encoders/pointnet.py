"""PointNet (Qi et al. 2017): one network on every point, and the largest value of each channel."""

from __future__ import annotations

import torch
from torch import nn

from gpca.encoders.group_mlp import GroupMLP
from gpca.encoders.grouping import Groups


class PointNet(nn.Module):
    """Shared layers of 64, 64, 64, 128 and 1024 channels, then max pooling: the published global feature.

    Its two transformer networks are left out: the first turns the cloud into a pose of its own choice, which would
    erase the pose concept, and the second aligns features after it. The cloud is used as it is.

    Args:
        width: that of the first three layers, 64 as published; the others grow with it.

    Attributes:
        embedding_size: d = 16 · width.
    """

    def __init__(self, width: int = 64) -> None:
        super().__init__()
        self.embedding_size = 16 * width
        self.layers = GroupMLP(0, (width, width, width, 2 * width, self.embedding_size))

    def forward(self, points_B_N_3: torch.Tensor) -> torch.Tensor:
        """Return embeddings (B, d) of clouds in the target's frame, in units of the object's diameter."""
        return self.layers(points_B_N_3, None, Groups.whole(points_B_N_3))[:, 0]
