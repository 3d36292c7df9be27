"""Gradients of GP-CA's scores: saliency of points, and TCAV."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.encoders.registry import DIFFERENTIABLE, DGCNNOptions, EncoderSettings
from gpca.errors import InputError
from gpca.experiments.experiment import Experiment, LeftOut, Tidy
from gpca.experiments.gradients.settings import GradientSettings


def check(config: dict, _left_out: LeftOut) -> None:
    """Check that enough points are left for the encoder where most are deleted."""
    encoder = EncoderSettings(**config["encoders"][config["embedding"]["encoder"]])
    if encoder.backbone != "dgcnn":
        return
    share, neighbors = max(config["gradients"]["deleted"]), encoder.options.get("k", DGCNNOptions.k)
    if round((1 - share) * encoder.draw_points) < neighbors:
        fault = f"deleting {share:g} of {encoder.draw_points} points leaves fewer than the encoder's {neighbors}"
        raise InputError("config key gradients.deleted", fault, "delete fewer")


def names(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the sources: all of them where the trained encoder that GP-CA reads has a gradient in the points."""
    backbone = config["encoders"][config["embedding"]["encoder"]]["backbone"]
    return {"gradient_source": list(sources) if backbone in DIFFERENTIABLE else []}


EXPERIMENT = Experiment(
    name="gradients",
    sections={"gradients": GradientSettings},
    tidy=(
        Tidy(
            "gradients.csv",
            "gpca.experiments.gradients.metrics:collect",
            {
                "deletion_files": "saliency/{gradient_source}/seed{seed}.csv",
                "tcav_files": "tcav/{gradient_source}/seed{seed}.csv",
            },
            rule="gradient_metrics",
        ),
    ),
    needs=("gradient_source",),
    names=names,
    shown=lambda config, _sources: {"gradients": config["gradients"]},
    check=check,
)
