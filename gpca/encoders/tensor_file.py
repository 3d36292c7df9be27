"""Files of torch.save, read without trust: whole to the byte, no code, and only possible numbers.

torch itself takes a file in which a bit has flipped for a whole one: it reads no checksum. Checkpoints are
such files; by them a stopped training continues.
"""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import torch

from gpca.io.files import whole_file
from gpca.io.limits import LARGEST_NUMBER
from gpca.pairs.dataset import Registrations


def read_tensors(path: str | Path) -> Any:
    """Return the content of a file of torch.save, on the CPU.

    Raises:
        ValueError: a member whose checksum differs, that is compressed or shared with another; a tensor that is
            larger than what the file holds of it, or holds NaN or numbers beyond all that can be.
        Exception: of many kinds, for a file that torch does not read.
    """
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
        if any(info.compress_type != zipfile.ZIP_STORED or info.compress_size != info.file_size for info in members):
            raise ValueError("it is compressed, which torch does not write")
        if sum(info.file_size for info in members) > Path(path).stat().st_size:
            raise ValueError("it claims to contain more than it does")
        if (damaged := archive.testzip()) is not None:
            raise ValueError(f"the checksum of its member '{damaged}' differs")
    content = torch.load(path, weights_only=True, map_location="cpu")
    for name, tensor in _tensors(content):
        _require_sound(name, tensor)
    return content


def write_tensors(path: str | Path, content: object) -> None:
    """Write a file, whole or not at all."""
    # Where torch.save gets a path, it writes the path's name into the file; here that is the temporary one.
    with whole_file(path) as partial, partial.open("wb") as file:
        torch.save(content, file)


def require_like(state: object, expected: Mapping[str, torch.Tensor], what: str) -> None:
    """Raise a ValueError unless a state has the names, shapes and types of `expected`, and no negative variances.

    The expected tensors may be on torch's meta device, which says what they would be and takes no memory.
    """
    if not isinstance(state, Mapping) or set(state) != set(expected):
        raise ValueError(f"its {what} has different parts")
    for name, tensor in expected.items():
        own = state[name]
        if not isinstance(own, torch.Tensor) or own.shape != tensor.shape or own.dtype != tensor.dtype:
            raise ValueError(f"'{name}' of its {what} has a different shape or type")
        if name.endswith("running_var") and (own < 0).any():
            raise ValueError(f"'{name}' of its {what} contains negative variances")


def _tensors(content: object) -> Iterator[tuple[str, torch.Tensor]]:
    """Yield every tensor with its name; a list may hold itself, so each is looked at once."""
    seen: set[int] = set()
    waiting = [("", content)]
    while waiting:
        name, part = waiting.pop()
        if isinstance(part, torch.Tensor):
            yield name, part
        elif isinstance(part, Mapping | list | tuple) and id(part) not in seen:
            seen.add(id(part))
            parts = part.items() if isinstance(part, Mapping) else enumerate(part)
            waiting += [(f"{name}.{key}" if name else str(key), inner) for key, inner in parts]


def _require_sound(name: str, tensor: torch.Tensor) -> None:
    if tensor.layout != torch.strided or tensor.device.type != "cpu" or tensor.is_quantized or tensor.is_complex():
        raise ValueError(f"'{name}' is a tensor of an unsupported kind")
    if tensor.numel() * tensor.element_size() > tensor.untyped_storage().nbytes():
        raise ValueError(f"'{name}' claims to be larger than its data in the file")
    # gpytorch keeps the bounds of its parameters, which may be infinite.
    if tensor.is_floating_point() and not name.endswith("_bound") and not (tensor.abs() <= LARGEST_NUMBER).all():
        raise ValueError(f"'{name}' contains NaN, infinity or numbers above {LARGEST_NUMBER:.0e}")


def fingerprint(registrations: Registrations) -> str:
    """Hash the data of a training: the clouds, their labels, and their splits."""
    digest = hashlib.sha256(registrations.points.tobytes())
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
