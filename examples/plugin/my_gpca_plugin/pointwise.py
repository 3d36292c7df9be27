"""Two linear layers on every point, then the largest value of each channel."""

import torch
from torch import nn


class Pointwise(nn.Module):
    """The smallest encoder that sees a cloud as a set."""

    def __init__(self, width: int = 64) -> None:
        super().__init__()
        self.layers = nn.Sequential(nn.Linear(3, width), nn.ReLU(), nn.Linear(width, width))
        self.embedding_size = width

    def forward(self, points_B_N_3: torch.Tensor) -> torch.Tensor:
        """Return embeddings (B, width)."""
        return self.layers(points_B_N_3).amax(dim=1)
