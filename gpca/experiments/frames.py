"""What experiments on depth frames share: titles of the frames and of encoders, and the rows of their tables."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gpca.declarations import Frame
from gpca.evaluation.measures import read_metrics
from gpca.frames.source import REAL_WORLD, resolve_datasets
from gpca.objects.entry import title_of
from gpca.reporting.words import dataset_in_words

TOGETHER = "attribution"  # all test samples, in the column `table`
CLASSIC = {"analytical_gpc": "Classic features", "analytical_gpc_no_counts": "Classic features without point counts"}
BACKBONES = {"dgcnn": "DGCNN", "pointnet": "PointNet", "pointnet2": "PointNet++", "pointnext": "PointNeXt-S"}
BACKBONES |= {"dgcnn_1024": "DGCNN of 1024 features"}
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


def reduced_backbones(frames: Mapping) -> list[str]:
    """Rows of Table VI that read embeddings: every encoder with every reduction."""
    return [f"{backbone}-{reduction}" for backbone in frames["backbones"] for reduction in frames["reductions"]]


def published_backbones(frames: Mapping) -> list[str]:
    """Rows beside those whose encoders are as published, with every reduction."""
    return [f"{encoder}-{name}" for encoder in frames["published"].values() for name in frames["reductions"]]


def pretraining_of(frames: Mapping, encoder: str) -> dict[str, Any]:
    """How an encoder of frames is pretrained; those as published have changes of their own."""
    own = frames.get("published_pretraining", {}) if encoder in frames["published"].values() else {}
    return {**frames["pretraining"], **own} if frames["pretraining"] else {}


def read_together(path: str | Path) -> Frame:
    """Rows of ``real_world.csv`` that Table VI shows: all test samples of the frames, by seed."""
    metrics = read_metrics(path)
    return metrics[(metrics["table"] == TOGETHER) & (metrics["source"] == REAL_WORLD)]
