"""An encoder of a registered pair: both clouds at once, each point described by how it lies to the other cloud.

It takes the features of :func:`gpca.features.distances.describe_points`, and the motion of ICP, which it hands on
beside its own features of the points.
"""

from __future__ import annotations

import torch
from torch import nn

from gpca.encoders.dgcnn import DGCNN

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


PAIR_ENCODERS = {"pair_dgcnn": PairDGCNN}
