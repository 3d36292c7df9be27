"""Model files of version 4, which torch wrote, read as arrays without torch and without executing code."""

import pickle
import zipfile
from collections import OrderedDict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gpca.io.array_tree import require_plausible, require_whole

VERSION = 4
NAMES = {
    "collections.OrderedDict": OrderedDict,
    "torch.FloatStorage": np.float32,
    "torch.DoubleStorage": np.float64,
    "torch.LongStorage": np.int64,
    "torch.IntStorage": np.int32,
    "torch.ShortStorage": np.int16,
}


def read_torch_file(path: str | Path) -> Any:
    """Return what :func:`torch.save` wrote, with arrays, as the next version has it; many errors if damaged."""
    with zipfile.ZipFile(path) as archive:
        require_whole(archive, Path(path))
        [pickled] = [name for name in archive.namelist() if name.endswith("/data.pkl")]
        with archive.open(pickled) as stream:
            content = _Tensors(stream, archive, pickled.removesuffix("data.pkl")).load()
    if isinstance(content, Mapping) and content.get("version") == VERSION:
        content = upgraded(content)
        require_plausible(content)
    return content


def upgraded(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a model of version 4 as the next version has it: with the parameters of covariances."""
    classifier = content["diagnoser"]["classifier"]
    for gpc in (content["gpc"], classifier["failure"], *classifier["causes"]):
        raw = gpc["kernel"]
        [parameter] = [name for name in raw if name in ("base_kernel.raw_lengthscale", "base_kernel.raw_offset")]
        with np.errstate(invalid="ignore"):  # NaN is refused afterwards
            scale, values = (np.logaddexp(np.float32(0), raw[name]) for name in ("raw_outputscale", parameter))
        gpc["kernel"] = {"scale": scale.astype(np.float64), "parameter": values.ravel().astype(np.float64)}
    return {**content, "version": VERSION + 1}


class _Tensors(pickle.Unpickler):
    """Reads tensors as arrays; any name but those of tensors is refused."""

    def __init__(self, stream: Any, archive: zipfile.ZipFile, folder: str) -> None:
        super().__init__(stream)
        self._archive, self._folder = archive, folder
        self._arrays: dict[tuple, np.ndarray] = {}

    def find_class(self, module: str, name: str) -> Any:
        names = NAMES | {"torch._utils._rebuild_tensor_v2": self._array}
        if (full_name := f"{module}.{name}") not in names:
            raise ValueError(f"it holds {full_name}, which no model does")
        return names[full_name]

    def persistent_load(self, pid: Any) -> np.ndarray:
        _, dtype, key, _, count = pid
        storage = np.frombuffer(self._archive.read(f"{self._folder}data/{key}"), dtype)
        if len(storage) != count:
            raise ValueError(f"its member '{key}' is not as long as it says")
        return storage

    def _array(self, storage: np.ndarray, offset: int, shape: tuple, strides: tuple, *_: object) -> np.ndarray:
        last = offset + sum((size - 1) * stride for size, stride in zip(shape, strides, strict=True))
        beyond = min((offset, *shape, *strides)) < 0 or (0 not in shape and last >= len(storage))
        if beyond or np.prod(shape, dtype=float) > len(storage):
            raise ValueError("a tensor claims to be larger than its data in the file")
        place = (storage.ctypes.data, offset, tuple(shape), tuple(strides))
        if place not in self._arrays:
            in_bytes = [stride * storage.itemsize for stride in strides]
            view = np.lib.stride_tricks.as_strided(storage[offset:], shape, in_bytes)
            self._arrays[place] = np.array(view, order="C")
        return self._arrays[place]
