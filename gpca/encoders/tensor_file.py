"""Files of torch.save from unknown hands: complete (torch checks no sum), without code, with plausible numbers."""

import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import torch

from gpca.io.array_tree import require_whole
from gpca.io.files import whole_file
from gpca.numerals import LARGEST_NUMBER


def read_tensors(path: str | Path) -> Any:
    """Return the content of a file of torch.save, on the CPU; ValueError for what is implausible, torch has others."""
    with zipfile.ZipFile(path) as archive:
        require_whole(archive, Path(path))
    content = torch.load(path, weights_only=True, map_location="cpu")
    for name, tensor in _tensors(content):
        if tensor.layout != torch.strided or tensor.device.type != "cpu" or tensor.is_quantized or tensor.is_complex():
            raise ValueError(f"'{name}' is a tensor of an unsupported kind")
        if tensor.numel() * tensor.element_size() > tensor.untyped_storage().nbytes():
            raise ValueError(f"'{name}' claims to be larger than its data in the file")
        # gpytorch stores the bounds of its parameters, which may be infinite.
        if tensor.is_floating_point() and not name.endswith("_bound") and not (tensor.abs() <= LARGEST_NUMBER).all():
            raise ValueError(f"'{name}' contains NaN, infinity or numbers above {LARGEST_NUMBER:.0e}")
    return content


def write_tensors(path: str | Path, content: object) -> None:
    """Write a file, complete or not at all."""
    # Given a path, torch.save writes its name into the file; here that would be the temporary one.
    with whole_file(path) as partial, partial.open("wb") as file:
        torch.save(content, file)


def _tensors(content: object) -> Iterator[tuple[str, torch.Tensor]]:
    """Yield every tensor with its name; a list may contain itself, so each is visited once."""
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
