"""Settings of the encoders, kept apart from their training, so that nothing here needs torch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from gpca.errors import InputError, with_key
from gpca.pairs.synthesis import Reading
from gpca.settings import Bounds, Count, PositiveShare, Share, changes_of, read_settings

OF_ANY_SIZE = ("dgcnn",)  # backbones that take clouds of unlike sizes together


@dataclass(frozen=True)
class EncoderSettings:
    """Settings of an encoder and of its training.

    Attributes:
        backbone: name in :mod:`gpca.encoders.registry`.
        draw_points: N, points of a cloud that the encoder sees at once.
        fewest_points: each draw from a cloud has a random number of points from this one to `draw_points`, so that
            the density tells nothing; always `draw_points` where it is None. Only DGCNN takes such draws.
        draws: an embedding is the mean over so many draws of N points from the cloud.
        reading: which cloud the encoder sees (:mod:`gpca.pairs.synthesis`).
        epochs, batch_size: length of the training, at most.
        validation_share: share of the training data, by groups, that is held out to find the best epoch by its loss.
        patience: epochs without a smaller validation loss after which training ends; None goes on.
        learning_rate: peak of the one-cycle schedule (Smith & Topin 2019) of AdamW.
        weight_decay: of AdamW.
        options: further arguments of the backbone.
        head: what is trained on the embedding with the encoder, and dropped: a linear layer, or two with dropout.
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
    head: Literal["linear", "two_layer"] = "linear"
    reading: Reading = "aligned"
    validation_share: Annotated[float, Bounds(minimum=0, maximum=0.5)] = 0.0
    patience: Count | None = None

    def __post_init__(self) -> None:
        if self.patience and not self.validation_share:
            raise InputError("encoder setting 'patience'", "needs held-out samples", "set validation_share above 0")
        neighbors = self.options.get("k", DGCNNOptions.k) if self.backbone == "dgcnn" else 0
        if (points := self.fewest_points or self.draw_points) < neighbors:
            fault = f"{neighbors} neighbors are too many for draws of {points} points"
            raise InputError("encoder option 'k'", fault, "lower it, or draw more points")
        if self.fewest_points is None:
            return
        if self.backbone not in OF_ANY_SIZE:
            fault = f"backbone '{self.backbone}' accepts clouds of one size only"
            raise InputError("encoder setting 'fewest_points'", fault, f"leave it out, or use {OF_ANY_SIZE[0]}")
        if self.fewest_points > self.draw_points:
            fault = f"{self.fewest_points} exceeds draw_points, {self.draw_points}"
            raise InputError("encoder setting 'fewest_points'", fault, "lower it")


@dataclass(frozen=True)
class DGCNNOptions:
    """Options of the backbone ``dgcnn``: neighbors of a point, and width of its features before the pooling."""

    k: Annotated[int, Bounds(minimum=2)] = 20
    point_features: Count = 256

    @property
    def embedding_size(self) -> int:
        """Numbers of an embedding."""
        return 2 * self.point_features


@dataclass(frozen=True)
class PointNetOptions:
    """Options of the backbones ``pointnet`` and ``pointnet_tnet``."""

    width: Count = 64

    @property
    def embedding_size(self) -> int:
        """Numbers of an embedding."""
        return 16 * self.width


@dataclass(frozen=True)
class PointNet2Options(PointNetOptions):
    """Options of the backbone ``pointnet2``."""

    centroids: Annotated[int, Bounds(minimum=4)] = 256
    radius: PositiveShare = 0.1
    neighbours: Count = 32
    as_published: bool = False


@dataclass(frozen=True)
class PointNeXtOptions(PointNetOptions):
    """Options of the backbone ``pointnext``."""

    width: Count = 32
    radius: PositiveShare = 0.075
    neighbours: Count = 32


EncoderChanges = Annotated[dict, changes_of(EncoderSettings, without=("backbone", "options"))]


def require_draws(key: str, encoder: Mapping[str, Any], points: int, points_key: str) -> None:
    """Check an encoder's settings at a key of the config: it draws no more points than clouds have at most.

    Args:
        points: of a cloud, which the config has at `points_key`.
    """
    settings = with_key(key, lambda: EncoderSettings(**encoder))
    if settings.draw_points > points:
        fault = f"draws {settings.draw_points} points of clouds that have at most {points}"
        raise InputError(f"config key {key}", fault, f"lower draw_points, or raise {points_key}")


# Of the backbones whose options the config checks; any other checks its own, when it is made.
OPTIONS = {
    "dgcnn": DGCNNOptions,
    "pointnet": PointNetOptions,
    "pointnet_tnet": PointNetOptions,
    "pointnet2": PointNet2Options,
    "pointnext": PointNeXtOptions,
}


@dataclass(frozen=True, kw_only=True)
class NamedEncoder(EncoderSettings):
    """An encoder, whose backbone is named; one without a class of options checks them itself, when it is made."""

    backbone: str = field()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.backbone in OPTIONS:
            read_settings(OPTIONS[self.backbone], self.options, "option")
