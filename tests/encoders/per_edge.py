"""The reference: EdgeConv as it is usually written, one linear layer on every edge."""

import torch
from torch import nn


class PerEdgeConv(nn.Module):
    def __init__(self, in_features, out_features, k):
        super().__init__()
        self.k = k
        self.linear = nn.Linear(2 * in_features, out_features, bias=False)
        self.norm = nn.BatchNorm2d(out_features)

    def forward(self, x_B_N_F, sizes=None):
        assert sizes is None, "clouds of unlike sizes are not in the reference"
        batch = len(x_B_N_F)
        squares = x_B_N_F.square().sum(-1, keepdim=True)
        distances = squares - 2 * x_B_N_F @ x_B_N_F.transpose(1, 2) + squares.transpose(1, 2)
        neighbors = distances.topk(self.k, dim=-1, largest=False).indices
        x_j = x_B_N_F[torch.arange(batch)[:, None, None], neighbors]
        x_i = x_B_N_F[:, :, None, :].expand(-1, -1, self.k, -1)
        edges = self.linear(torch.cat([x_j - x_i, x_i], dim=-1))
        edges = self.norm(edges.permute(0, 3, 1, 2)).permute(0, 2, 3, 1)
        return nn.functional.leaky_relu(edges, 0.2).amax(dim=2)
