"""Files of nested mappings and lists with arrays, as a zip of JSON and arrays; reading one executes no code."""

import json
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gpca.io.arrays import read_member
from gpca.io.files import whole_file
from gpca.io.structured_text import parse_json
from gpca.numerals import LARGEST_NUMBER

TEXT = "content.json"  # the member without the arrays, in whose place is {"array": the name of a member}
KEY = "array"
DEEPEST = 20  # levels of mappings and lists


def write_tree(path: str | Path, tree: object) -> None:
    """Write a file, complete or not at all; equal trees give equal bytes. Arrays that occur twice are kept once."""
    arrays: dict[int, tuple[str, np.ndarray]] = {}

    def named(name: str, array: np.ndarray) -> dict[str, str]:
        return {KEY: arrays.setdefault(id(array), (name, array))[0]}

    text = json.dumps(_replaced(tree, lambda part: isinstance(part, np.ndarray), named), allow_nan=False, indent=1)
    with whole_file(path) as partial, zipfile.ZipFile(partial, "w") as archive:
        archive.writestr(zipfile.ZipInfo(TEXT), text)
        for name, array in arrays.values():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.ascontiguousarray(array).reshape(array.shape), allow_pickle=False)


def read_tree(path: str | Path) -> Any:
    """Return the tree of a file; errors of many kinds for a damaged one, a ValueError for what is implausible."""
    with zipfile.ZipFile(path) as archive:
        require_whole(archive, Path(path))
        arrays: dict[str, np.ndarray] = {}

        def loaded(_name: str, part: Mapping) -> np.ndarray:
            name = part[KEY]
            if name not in arrays:
                arrays[name] = read_member(archive, archive.getinfo(f"{name}.npy"))
            return arrays[name]

        text = archive.read(TEXT).decode("utf-8")
        tree = _replaced(parse_json(text), lambda part: isinstance(part, Mapping) and set(part) == {KEY}, loaded)
    require_plausible(tree)
    return tree


def require_whole(archive: zipfile.ZipFile, path: Path) -> None:
    """Raise a ValueError unless the members of a zip are stored as they are, without damage."""
    members = archive.infolist()
    if any(info.compress_type != zipfile.ZIP_STORED or info.compress_size != info.file_size for info in members):
        raise ValueError("it is compressed, which neither torch nor the suite writes")
    if sum(info.file_size for info in members) > path.stat().st_size:
        raise ValueError("it claims to contain more than it does")
    if (damaged := archive.testzip()) is not None:
        raise ValueError(f"the checksum of its member '{damaged}' differs")


def require_plausible(tree: object) -> None:
    """Raise a ValueError unless all numbers of the arrays of a tree are finite and measurable."""
    for name, array in _arrays(tree):
        if array.dtype.kind == "f" and not (np.abs(array) <= LARGEST_NUMBER).all():
            raise ValueError(f"'{name}' contains NaN, infinity or numbers above {LARGEST_NUMBER:.0e}")


def _arrays(part: object, name: str = "", depth: int = 0) -> Iterator[tuple[str, np.ndarray]]:
    if isinstance(part, np.ndarray):
        yield name, part
    elif isinstance(part, Mapping | list | tuple):
        if depth == DEEPEST:
            raise ValueError(f"'{name}' is nested too deeply")
        for key, inner in part.items() if isinstance(part, Mapping) else enumerate(part):
            yield from _arrays(inner, f"{name}.{key}" if name else str(key), depth + 1)


def _replaced(part: Any, chosen: Callable[[Any], bool], change: Callable[[str, Any], Any], name: str = "") -> Any:
    """Return a tree with the chosen parts changed, given their place, such as ``gpc/kernel/scale``, and themselves."""
    if chosen(part):
        return change(name, part)
    if isinstance(part, Mapping):
        return {key: _replaced(inner, chosen, change, f"{name}/{key}".lstrip("/")) for key, inner in part.items()}
    if isinstance(part, list | tuple):
        return [_replaced(inner, chosen, change, f"{name}/{i}".lstrip("/")) for i, inner in enumerate(part)]
    return part
