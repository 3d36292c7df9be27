"""Backbones by name, their options, and the settings of an encoder and its training; nothing here loads torch."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Annotated, Any, Literal

from gpca.errors import InputError, with_key
from gpca.pairs.synthesis import Reading
from gpca.process.registry import Registry, load
from gpca.settings import Bounds, Count, PositiveShare, Share, changes_of, read_settings

ENCODERS = {
    "dgcnn": "gpca.encoders.dgcnn:DGCNN",
    "pointnet": "gpca.encoders.pointnet:PointNet",
    "pointnet2": "gpca.encoders.pointnet:PointNet2",
    "pointnext": "gpca.encoders.pointnet:PointNeXt",
}
REGISTRY: Registry[str] = Registry("backbone", "", "ENCODERS", first=(__name__,), outside=str)
encoders = REGISTRY.entries  # ``module:class`` by name
OF_ANY_SIZE = ("dgcnn",)  # backbones that take clouds of different sizes in one batch


def encoder_module(settings: Mapping) -> str:
    return encoders()[settings["backbone"]].split(":")[0]


def require_backbone(backbone: str) -> None:
    """Raise an InputError that lists the backbones unless `backbone` is one of them, and its module is there."""
    listed = REGISTRY.entry(backbone)
    module, colon, _ = listed.partition(":")
    try:
        is_there = bool(colon) and (backbone in ENCODERS or find_spec(module) is not None)
    except (ImportError, ValueError):
        is_there = False
    if not is_there:
        raise InputError(f"backbone '{backbone}'", f"there is no {listed}", "list it as module:class")


def make_encoder(backbone: str, options: dict):
    """Return a new encoder, a module from clouds (B, N, 3) to embeddings (B, ``embedding_size``)."""
    require_backbone(backbone)
    try:
        encoder = load(encoders()[backbone])(**options)
    except TypeError as fault:
        raise InputError(f"backbone '{backbone}'", str(fault), "see encoder.options in the config") from fault
    except AttributeError as fault:
        raise InputError(f"backbone '{backbone}'", str(fault), "give ENCODERS module:class") from fault
    size = getattr(encoder, "embedding_size", None)
    if not hasattr(encoder, "state_dict") or type(size) is not int or size < 1:
        words = f"is a {type(encoder).__name__} whose embedding_size is {size!r}"
        raise InputError(f"backbone '{backbone}'", words, "make it a module of torch with a whole embedding_size")
    return encoder


def parameter_count(module) -> int:
    return sum(parameter.numel() for parameter in module.parameters() if parameter.requires_grad)


@dataclass(frozen=True)
class DGCNNOptions:
    """Neighbors per point, and width of its features before the pooling."""

    k: Annotated[int, Bounds(minimum=2)] = 20
    point_features: Count = 256

    @property
    def embedding_size(self) -> int:
        return 2 * self.point_features


@dataclass(frozen=True)
class PointNetOptions:
    """Options of PointNet."""

    width: Count = 64

    @property
    def embedding_size(self) -> int:
        return 16 * self.width


@dataclass(frozen=True)
class PointNet2Options(PointNetOptions):
    """Options of PointNet++."""

    centroids: Annotated[int, Bounds(minimum=4)] = 256
    radius: PositiveShare = 0.1
    neighbours: Count = 32


@dataclass(frozen=True)
class PointNeXtOptions(PointNetOptions):
    """Options of PointNeXt."""

    width: Count = 32
    radius: PositiveShare = 0.075
    neighbours: Count = 32


# Options that the config checks; any other backbone checks its own when it is made.
OPTIONS = {
    "dgcnn": DGCNNOptions,
    "pointnet": PointNetOptions,
    "pointnet2": PointNet2Options,
    "pointnext": PointNeXtOptions,
}


@dataclass(frozen=True)
class EncoderSettings:
    """Settings of an encoder and of its training."""

    backbone: str = "dgcnn"
    draw_points: Annotated[int, Bounds(minimum=32)] = 512  # N, points of a cloud that the encoder sees at once
    draws: Count = 4  # an embedding is the mean over this many draws of N points
    epochs: Count = 10  # at most
    batch_size: Annotated[int, Bounds(minimum=2)] = 16
    learning_rate: PositiveShare = 4e-3  # peak of AdamW's one-cycle schedule (Smith & Topin 2019)
    weight_decay: Share = 1e-2  # of AdamW
    options: dict = field(default_factory=dict)  # further arguments of the backbone
    # If given, a draw has a random number of points from this one to `draw_points`: its density carries no information.
    fewest_points: Annotated[int, Bounds(minimum=32)] | None = None
    head: Literal["linear", "two_layer"] = "linear"  # trained together with the encoder, then dropped
    reading: Reading = "aligned"  # the cloud that the encoder sees (:mod:`gpca.pairs.synthesis`)
    validation_share: Annotated[float, Bounds(minimum=0, maximum=0.5)] = 0.0  # of the groups, to find the best epoch
    patience: Count | None = None  # epochs without a smaller validation loss after which training ends

    def __post_init__(self) -> None:
        if self.patience and not self.validation_share:
            raise InputError("encoder setting 'patience'", "needs held-out samples", "set validation_share above 0")
        neighbors = self.options.get("k", DGCNNOptions.k) if self.backbone == "dgcnn" else 0
        if (points := self.fewest_points or self.draw_points) < neighbors:
            fault = f"{neighbors} neighbors are too many for draws of {points} points"
            raise InputError("encoder option 'k'", fault, "lower it, or draw more points")
        if self.fewest_points and self.backbone not in OF_ANY_SIZE:
            fault = f"backbone '{self.backbone}' accepts clouds of one size only"
            raise InputError("encoder setting 'fewest_points'", fault, f"leave it out, or use {OF_ANY_SIZE[0]}")
        if self.fewest_points and self.fewest_points > self.draw_points:
            fault = f"{self.fewest_points} exceeds draw_points, {self.draw_points}"
            raise InputError("encoder setting 'fewest_points'", fault, "lower it")


EncoderChanges = Annotated[dict, changes_of(EncoderSettings, without=("backbone", "options"))]


@dataclass(frozen=True, kw_only=True)
class NamedEncoder(EncoderSettings):
    """Settings of an encoder whose backbone must be given, with checked options."""

    backbone: str = field()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.backbone in OPTIONS:
            read_settings(OPTIONS[self.backbone], self.options, "option")


def require_draws(key: str, encoder: Mapping[str, Any], points: int, points_key: str) -> None:
    """Raise an InputError if the encoder at a config key draws more points than clouds have (`points_key`)."""
    settings = with_key(key, lambda: EncoderSettings(**encoder))
    if settings.draw_points > points:
        fault = f"draws {settings.draw_points} points of clouds that have at most {points}"
        raise InputError(f"config key {key}", fault, f"lower draw_points, or raise {points_key}")
