"""Frozen dataclasses that live in npz files: each array declares its shape, type and limits once, where it is named."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeAlias

import numpy as np

from gpca.errors import InputError
from gpca.io.arrays import REAL, REGENERATE, TEXT, WHOLE, axes_in, load_arrays, save_arrays
from gpca.io.files import Axes

if TYPE_CHECKING:
    import pandas as pd

Columns: TypeAlias = "Mapping[str, np.ndarray] | pd.DataFrame"
Shapes = dict[str, tuple[int | str, ...]]
FLAG, FLOAT = "b", "f"  # booleans, and numbers that may not be whole; beside TEXT, WHOLE and REAL
REGENERATE_BOTH = "regenerate both from the same config"


@dataclass(frozen=True)
class ArrayField:
    """What an array holds; with `offsets`, row i has the part ``array[offsets[i]:offsets[i + 1]]``."""

    shape: tuple[int | str, ...]  # sizes, and names of dimensions, which have one size in a file; `S+1` is one more
    kind: str = REAL  # TEXT, WHOLE, REAL, FLOAT or FLAG
    least: float = -np.inf
    most: float = np.inf
    choices: tuple[str, ...] = ()  # its words
    offsets: str = ""  # the field with the limits of the parts
    fewest: int = 1  # length of a part at least; 0 allows none at all


def array(shape: str, kind: str = REAL, **limits: Any) -> Any:
    """Declare a field of a container, as ``array("S 4 4")``; see :class:`ArrayField` for the limits."""
    sizes = tuple(int(size) if size.isdigit() else size for size in shape.split())
    return field(metadata={"array": ArrayField(sizes, kind, **limits)})


@dataclass(frozen=True)
class Container:
    """Arrays of samples, counted by the first dimension of the first, and the file that holds them."""

    axes: Axes | None = field(default=None, kw_only=True)
    remedy: ClassVar[str] = REGENERATE  # what to do about a damaged file
    names_axes: ClassVar[bool] = False  # whether a file has to name its source and seed, whichever they are

    @classmethod
    def array_fields(cls) -> dict[str, ArrayField]:
        """Return the arrays by name, in the order of the file."""
        return {each.name: each.metadata["array"] for each in fields(cls) if "array" in each.metadata}

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays by name, in the order of the file."""
        return {name: getattr(self, name) for name in self.array_fields()}

    def __len__(self) -> int:
        return len(getattr(self, next(iter(self.array_fields()))))

    def part(self, name: str, i: int) -> np.ndarray:
        """Return what row i has of an array of parts."""
        first, last = getattr(self, self.array_fields()[name].offsets)[i : i + 2]
        return getattr(self, name)[first:last]

    def subset(self, rows: np.ndarray) -> Self:
        """Return the given rows, in the given order, or those of a mask."""
        return self._of_parts([(self, np.arange(len(self))[rows])])

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Return the samples of several containers one after another, which then have no axes."""
        return replace(parts[0], axes=None)._of_parts([(part, np.arange(len(part))) for part in parts])

    def _of_parts(self, parts: Sequence[tuple[Self, np.ndarray]]) -> Self:
        declared = self.array_fields()
        samples = next(iter(declared.values())).shape[0]
        chosen: dict[str, Any] = {}
        for name, spec in declared.items():
            if spec.offsets:
                pieces = [part.part(name, i) for part, rows in parts for i in rows]
                chosen[name] = np.concatenate(pieces or [getattr(self, name)[:0]])
                chosen[spec.offsets] = np.cumsum([0, *map(len, pieces)], dtype=np.int64)
            elif spec.shape[0] == samples:
                chosen[name] = np.concatenate([getattr(part, name)[rows] for part, rows in parts])
        return replace(self, **chosen)

    def save(self, path: str | Path, axes: Axes | None = None) -> None:
        """Write the npz described in results/README.md, with this source and seed, or those of the samples."""
        save_arrays(path, self.arrays, axes or self.axes)

    @classmethod
    def load(cls, path: str | Path, expected: Axes | Container | None = None) -> Self:
        """Read the npz; `expected` is the source and seed that it names, or the container whose samples it holds."""
        samples, axes = (expected, expected.axes) if isinstance(expected, Container) else (None, expected)
        arrays = cls.read(path, axes)
        named = axes_in(arrays) if "source" in arrays else axes
        loaded = cls(**{name: arrays[name] for name in cls.array_fields()}, axes=named)
        loaded.check(path)
        if samples is not None:
            require_same_samples(path, loaded.arrays, samples.arrays)
        return loaded

    @classmethod
    def read(cls, path: str | Path, axes: Axes | None, **sizes: int) -> dict[str, Any]:
        """Return the arrays of a file, of the right shapes and types, for these sizes of dimensions."""
        declared = cls.array_fields()
        shapes: Shapes = {name: tuple(sizes.get(str(size), size) for size in of.shape) for name, of in declared.items()}
        kinds = {name: of.kind for name, of in declared.items()}
        if cls.names_axes:
            shapes, kinds = shapes | {"source": (), "seed": ()}, kinds | {"source": TEXT, "seed": WHOLE}
        return load_arrays(path, shapes, kinds, axes, remedy=cls.remedy)

    def check(self, path: str | Path) -> None:
        """Raise an InputError where values are impossible or parts and their limits do not match."""
        for name, of in self.array_fields().items():
            values = getattr(self, name)
            if of.offsets:
                offsets = getattr(self, of.offsets)
                if offsets[0] != 0 or offsets[-1] != len(values):
                    raise InputError(path, f"'{of.offsets}' do not match '{name}'", self.remedy)
                if (len(offsets) == 1 and of.fewest) or (np.diff(offsets) < of.fewest).any():
                    raise InputError(path, f"has no samples, or one with fewer than {of.fewest} '{name}'", self.remedy)
            if of.choices and (unknown := set(values.tolist()) - set(of.choices)):
                raise InputError(path, f"unknown {name} {min(unknown)!r}", f"expected one of {', '.join(of.choices)}")
            if of.kind != TEXT and of.kind != FLAG and not ((values >= of.least) & (values <= of.most)).all():
                raise InputError(path, f"'{name}' contains impossible values", self.remedy)


def require_same_samples(
    path: str | Path, rows: Columns, samples: Columns, what: str = "registrations", by: Sequence = ("sample", "split")
) -> None:
    """Raise an InputError unless the rows of a file are those of `samples`, by these columns and in their order."""
    for name in by:
        if list(map(str, rows[name])) != list(map(str, samples[name])):
            raise InputError(path, f"its samples differ from those of the {what}", REGENERATE_BOTH)
