"""Checkpoints by which a stopped training continues: its state after each epoch, and what must agree."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch

from gpca.encoders.tensor_file import read_tensors, write_tensors
from gpca.pairs.dataset import Registrations


def fingerprint(registrations: Registrations, targets_S_C: np.ndarray | None) -> str:
    """Hash the data of a training: the clouds, their labels or targets, and their splits."""
    digest = hashlib.sha256(registrations.points.tobytes())
    digest.update(b"" if targets_S_C is None else targets_S_C.tobytes())
    for column in (registrations.offsets, registrations.concept, registrations.split, registrations.sample):
        digest.update(repr(column.tolist()).encode())
    return digest.hexdigest()


def fingerprint_of(weights: Mapping[str, torch.Tensor] | None) -> str:
    """Hash the weights that a training starts from, if any are given."""
    digest = hashlib.sha256()
    for name, tensor in (weights or {}).items():
        digest.update(name.encode() + tensor.numpy().tobytes())
    return digest.hexdigest()


def keep(checkpoint: Path | None, identity: str, state: dict, curve: list[dict]) -> None:
    """Write the state and the training curve so far, where a checkpoint is wanted."""
    if checkpoint is None:
        return
    content = {name: part.state_dict() for name, part in state.items()}
    write_tensors(checkpoint, content | {"identity": identity, "curve": curve})


def resume(checkpoint: Path | None, identity: str, state: dict) -> list[dict]:
    """Load the checkpoint into `state`; an unreadable one or one of other settings or data is left aside."""
    if checkpoint is None or not checkpoint.is_file():
        return []
    try:
        content = read_tensors(checkpoint)
    except Exception:  # whatever a damaged file makes torch raise, training from the start is right
        return []
    if not isinstance(content, dict) or content.get("identity") != identity or not set(state) <= set(content):
        return []
    for name, part in state.items():
        part.load_state_dict(content[name])
    return content["curve"]
