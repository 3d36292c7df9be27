"""What experiments on depth frames share: titles of the frames and of encoders, and the rows of their tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.frames.source import resolve_datasets
from gpca.objects.entry import title_of
from gpca.reporting.words import dataset_in_words

BACKBONES = {"dgcnn": "DGCNN", "pointnet": "PointNet", "pointnet2": "PointNet++", "pointnext": "PointNeXt-S"}
BACKBONES |= {"dgcnn_1024": "DGCNN of 1024 features", "pointnet_tnet": "PointNet with T-Nets"}
BACKBONES |= {"pointnet2_ssg": "PointNet++ as published"}
REDUCTIONS = {"none": "No reduction", "pca": "PCA", "umap": "UMAP", "autoencoder": "Autoencoder"}


def encoder_title(encoder: str, reduction: str) -> str:
    """Name of an encoder, and of the reduction after it, in figures."""
    title = BACKBONES.get(encoder, encoder)
    return title if reduction == "none" else f"{title}, {REDUCTIONS.get(reduction, reduction)}"


def frames_of(config: Mapping[str, Any]) -> dict[str, Any]:
    """Title of a run's depth frames, and whether they are a stand-in; optional datasets may be absent."""
    frames = config["real_world"]
    title = frames["title"]
    if not title:
        datasets = resolve_datasets(frames["datasets"], config["data_dir"])
        *others, last = [dataset_in_words(name) for name in datasets] or ["Table-top RGB-D"]
        title = f"{', '.join(others)} and {last} frames" if others else f"{last} frames"
    return {"title": title, "stand_in": not frames["datasets"]}


def title_of_frames(config: Mapping[str, Any]) -> str:
    """Title of a run's depth frames, which says so where they are a stand-in."""
    return title_of(frames_of(config))
