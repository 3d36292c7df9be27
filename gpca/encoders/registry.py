"""Encoders by name. A new one is a file beside this one and a line here, or comes from outside."""

from __future__ import annotations

from gpca.errors import InputError, require_known
from gpca.plugins import joined_outside
from gpca.registry import load

ENCODERS = {
    "dgcnn": "gpca.encoders.dgcnn:DGCNN",
    "pointnet": "gpca.encoders.pointnet:PointNet",
    "pointnet_tnet": "gpca.encoders.pointnet_tnet:PointNetTNet",
    "pointnet2": "gpca.encoders.pointnet2:PointNet2",
    "pointnext": "gpca.encoders.pointnext:PointNeXt",
}
DIFFERENTIABLE = ("dgcnn", "pointnet")  # those that, once trained, still have a gradient in the points on the processor


def encoders() -> dict[str, str]:
    """Return ``module:class`` of every encoder by name, those from outside included."""
    return joined_outside("ENCODERS", "backbone", str, ENCODERS)


def make_encoder(backbone: str, options: dict):
    """Return a new encoder, a module from clouds (B, N, 3) to embeddings (B, ``embedding_size``).

    Raises:
        InputError: unknown backbone, or an option that it does not have.
    """
    require_backbone(backbone)
    try:
        return load(encoders()[backbone])(**options)
    except TypeError as fault:
        raise InputError(f"backbone '{backbone}'", str(fault), "see encoder.options in the config") from fault


def require_backbone(backbone: str) -> None:
    """Raise an InputError that names the known backbones unless `backbone` is one of them."""
    require_known("backbone", backbone, encoders())


def parameter_count(module) -> int:
    """Return how many numbers of a torch module are trained."""
    return sum(parameter.numel() for parameter in module.parameters() if parameter.requires_grad)
