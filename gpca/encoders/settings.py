"""Settings of the encoders, apart from what trains them: nothing here needs torch."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from gpca.errors import InputError
from gpca.settings import Bounds, Count, PositiveShare, Share

OF_ANY_SIZE = ("dgcnn",)  # backbones that take clouds of unlike sizes together


@dataclass(frozen=True)
class EncoderSettings:
    """What is trained and how.

    Attributes:
        backbone: name in :mod:`gpca.encoders.registry`.
        draw_points: N, points of a cloud that the encoder sees at once.
        fewest_points: each draw from a cloud has a random number of points from this one to `draw_points`, so that
            the density tells nothing; always `draw_points` where it is None. Only DGCNN takes such draws.
        draws: an embedding is the mean over so many draws of N points from the cloud.
        epochs, batch_size: length of the training.
        learning_rate: peak of the one-cycle schedule (Smith & Topin 2019) of AdamW.
        weight_decay: of AdamW.
        options: further arguments of the backbone.
        head_layers: linear layers of the head that the encoder is trained with.
    """

    backbone: str = "dgcnn"
    draw_points: Annotated[int, Bounds(minimum=32)] = 512
    draws: Count = 4
    epochs: Count = 10
    batch_size: Annotated[int, Bounds(minimum=2)] = 16
    learning_rate: PositiveShare = 4e-3
    weight_decay: Share = 1e-2
    options: dict = field(default_factory=dict)
    fewest_points: Annotated[int, Bounds(minimum=32)] | None = None
    head_layers: Annotated[int, Bounds(minimum=1, maximum=2)] = 1

    def __post_init__(self) -> None:
        if self.fewest_points is None:
            return
        if self.backbone not in OF_ANY_SIZE:
            fault = f"backbone '{self.backbone}' takes clouds of one size only"
            raise InputError("encoder setting 'fewest_points'", fault, f"leave it out, or use {OF_ANY_SIZE[0]}")
        if self.fewest_points > self.draw_points:
            fault = f"{self.fewest_points} is above draw_points, {self.draw_points}"
            raise InputError("encoder setting 'fewest_points'", fault, "lower it")


@dataclass(frozen=True)
class DGCNNOptions:
    """Options of the backbone ``dgcnn``: neighbours of a point, and width of its features before the pooling."""

    k: Annotated[int, Bounds(minimum=2)] = 20
    point_features: Count = 256


@dataclass(frozen=True)
class PointNetOptions:
    """Options of the backbone ``pointnet``."""

    width: Count = 64


@dataclass(frozen=True)
class PointNet2Options:
    """Options of the backbone ``pointnet2``."""

    width: Count = 64
    centroids: Annotated[int, Bounds(minimum=4)] = 256
    radius: PositiveShare = 0.1
    neighbours: Count = 32


@dataclass(frozen=True)
class PointNeXtOptions:
    """Options of the backbone ``pointnext``."""

    width: Count = 32
    radius: PositiveShare = 0.075
    neighbours: Count = 32


# Of the backbones whose options the config checks; any other checks its own, when it is made.
OPTIONS = {
    "dgcnn": DGCNNOptions,
    "pointnet": PointNetOptions,
    "pointnet2": PointNet2Options,
    "pointnext": PointNeXtOptions,
}
