"""Registrations: perturbed pairs, aligned by ICP, labeled with their concept, and the file that holds them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.alignment.rigid import inverse, scale_translation, transform
from gpca.errors import InputError
from gpca.io.arrays import REAL, REGENERATE, TEXT, WHOLE, axes_in, load_arrays, save_arrays
from gpca.io.csv_file import numbers, read_csv
from gpca.io.names import SPLITS, Axes
from gpca.objects.canonical import LARGEST_DIAMETER_M, SMALLEST_DIAMETER_M
from gpca.pairs.perturbation import CONCEPTS

if TYPE_CHECKING:
    import pandas as pd

FARTHEST = 1e3  # diameters from the target's center; a registration may fail, but nothing lies so far away
SAMPLE_COLUMNS = ("sample", "split", "instance", "dataset", "in_training")
FRAME_COLUMNS = (  # all that the file may hold
    *SAMPLE_COLUMNS,
    *("concept", "scene", "image", "object", "symmetric", "init_from", "init_error", "icp_error", "lost_to"),
)
RIGID_TOLERANCE = 1e-2  # of a rotation's products with itself; datasets round their poses


@dataclass(frozen=True)
class Registrations:
    """S registrations. Lengths are relative to the object's diameter unless the name ends in ``_m``.

    Attributes:
        sample: (S,) number of the sample within its split.
        split: (S,) ``train`` or ``test``.
        concept: (S,) what was perturbed: ``noise``, ``pose`` or ``overlap``.
        object_index, object_name, diameter_m: (S,) the object registered.
        cluster, fold: (S,) samples that are alike: a family of shapes or a scene (:mod:`gpca.objects.splits`).
        points: (ΣP, 3) float32, the ICP-aligned source clouds in the target's frame; cloud i is
            ``points[offsets[i]:offsets[i + 1]]``.
        target_points, target_offsets: the clean target clouds (ΣQ, 3) float32, in the same frame and kept the same way.
        severity_noise, severity_rotation_rad, severity_translation, severity_crop: (S,) as drawn, 0 where not applied.
        T_target_source_true, T_target_source_init, T_target_source_icp: (S, 4, 4), translations in meters.
        fitness, inlier_rmse: (S,) of ICP.
        attached: arrays (S, …) from other files, for explainers that read them: ``embedding``, ``head_logits``, …
        axes: the source and the seed that they are of; None where they are of several.
    """

    sample: np.ndarray
    split: np.ndarray
    concept: np.ndarray
    object_index: np.ndarray
    object_name: np.ndarray
    diameter_m: np.ndarray
    cluster: np.ndarray
    fold: np.ndarray
    points: np.ndarray
    offsets: np.ndarray
    target_points: np.ndarray
    target_offsets: np.ndarray
    severity_noise: np.ndarray
    severity_rotation_rad: np.ndarray
    severity_translation: np.ndarray
    severity_crop: np.ndarray
    T_target_source_true: np.ndarray
    T_target_source_init: np.ndarray
    T_target_source_icp: np.ndarray
    fitness: np.ndarray
    inlier_rmse: np.ndarray
    attached: Mapping[str, np.ndarray] = field(default_factory=dict)
    axes: Axes | None = None

    def __len__(self) -> int:
        return len(self.sample)

    def cloud(self, i: int) -> np.ndarray:
        """Return the aligned source cloud (P, 3) of row i."""
        return self.points[self.offsets[i] : self.offsets[i + 1]]

    def target(self, i: int) -> np.ndarray:
        """Return the target cloud (Q, 3) of row i."""
        return self.target_points[self.target_offsets[i] : self.target_offsets[i + 1]]

    def source(self, i: int) -> np.ndarray:
        """Return the source cloud (P, 3) of row i as it was observed, before ICP."""
        return transform(inverse(self.T_target_source("icp", i)), self.cloud(i).astype(np.float64))

    def T_target_source(self, which: str, i: int) -> np.ndarray:
        """Return the pose ``init``, ``icp`` or ``true`` of row i in the unit of the clouds, the object's diameter."""
        return scale_translation(getattr(self, f"T_target_source_{which}")[i], 1 / self.diameter_m[i])

    @property
    def embedding(self) -> np.ndarray:
        """(S, d) of the encoder; only where it is attached."""
        return self.attached["embedding"]

    def rows(self, split: str) -> np.ndarray:
        """Return the row numbers of a split."""
        return np.flatnonzero(self.split == split)

    def subset(self, rows: np.ndarray) -> Registrations:
        """Return the given rows, in the given order."""
        columns: dict[str, Any] = {name: getattr(self, name)[rows] for name in REGISTRATION_COLUMNS}
        attached = {name: array[rows] for name, array in self.attached.items()}
        columns |= ragged([self.cloud(i) for i in rows], [self.target(i) for i in rows])
        return replace(self, **columns, attached=attached)

    def without_labels(self) -> Registrations:
        """Return the same registrations as explainers may see them, without anything that reveals the perturbation."""
        nan_S = np.full(len(self), np.nan)
        unknown: dict[str, Any] = dict.fromkeys(
            (name for name in REGISTRATION_COLUMNS if name.startswith("severity_")), nan_S
        )
        unknown["T_target_source_true"] = np.full_like(self.T_target_source_true, np.nan)
        return replace(self, concept=np.full(len(self), ""), **unknown)

    def save(self, path: str | Path) -> None:
        """Write the npz described in results/README.md."""
        save_arrays(path, {name: getattr(self, name) for name in (*REGISTRATION_COLUMNS, *CLOUDS)}, self.axes)

    @classmethod
    def load(cls, path: str | Path, axes: Axes | None = None) -> Registrations:
        """Read the npz.

        Args:
            path: the file.
            axes: the source and the seed that it has to be of; it may be of any where this is None.

        Raises:
            InputError: the file is missing, damaged, of another source or seed, holds pickled objects, wrong shapes,
                NaN or unknown labels.
        """
        shapes: dict[str, tuple[int | str, ...]] = dict.fromkeys(REGISTRATION_COLUMNS, ("S",))
        shapes |= {name: ("S", 4, 4) for name in REGISTRATION_COLUMNS if name.startswith("T_")}
        shapes |= {"points": ("P", 3), "offsets": ("O",), "target_points": ("Q", 3), "target_offsets": ("R",)}
        kinds = dict.fromkeys(shapes, REAL) | dict.fromkeys(("split", "concept", "object_name", "cluster"), TEXT)
        kinds |= dict.fromkeys(("sample", "object_index", "fold", "offsets", "target_offsets"), WHOLE)
        of = {"source": TEXT, "seed": WHOLE}
        arrays = load_arrays(path, shapes | dict.fromkeys(of, ()), kinds | of, axes)
        for points, ends in (("points", "offsets"), ("target_points", "target_offsets")):
            offsets = arrays[ends]
            if len(offsets) != len(arrays["sample"]) + 1 or offsets[0] != 0 or offsets[-1] != len(arrays[points]):
                raise InputError(path, f"'{ends}' do not match '{points}' and 'sample'", REGENERATE)
            if len(offsets) == 1 or (np.diff(offsets) < 3).any():
                raise InputError(path, "has no samples, or a cloud of fewer than 3 points", REGENERATE)
        if unknown := set(arrays["concept"].tolist()) - set(CONCEPTS):
            raise InputError(path, f"unknown concept {sorted(unknown)[0]!r}", f"expected one of {', '.join(CONCEPTS)}")
        for name, within in _possible(arrays).items():
            if not within.all():
                raise InputError(path, f"'{name}' contains impossible values", REGENERATE)
        columns: dict[str, Any] = {name: arrays[name] for name in shapes}
        return cls(**columns, axes=axes_in(arrays))


def _possible(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return for each array which of its entries are possible."""
    possible = {name: arrays[name] >= 0 for name in ("sample", "object_index", "inlier_rmse")}
    possible |= {name: arrays[name] >= 0 for name in arrays if name.startswith("severity_")}
    possible |= {name: np.abs(arrays[name]) <= FARTHEST for name in ("points", "target_points")}
    possible["fitness"] = (arrays["fitness"] >= 0) & (arrays["fitness"] <= 1)
    diameter_m = arrays["diameter_m"]
    possible["diameter_m"] = (diameter_m >= SMALLEST_DIAMETER_M) & (diameter_m <= LARGEST_DIAMETER_M)
    for name in (name for name in arrays if name.startswith("T_")):
        R_S_3_3 = arrays[name][:, :3, :3]
        products_S_3_3 = np.einsum("sij,skj->sik", R_S_3_3, R_S_3_3)
        rigid_S = np.abs(products_S_3_3 - np.eye(3)).max(axis=(1, 2)) < RIGID_TOLERANCE
        reach_m = FARTHEST * LARGEST_DIAMETER_M  # a camera, too, is no farther from what it sees
        possible[name] = (
            rigid_S
            & (np.linalg.det(R_S_3_3) > 0)
            & (arrays[name][:, 3] == (0, 0, 0, 1)).all(axis=1)
            & (np.abs(arrays[name][:, :3, 3]) <= reach_m).all(axis=1)
        )
    samples = list(zip(arrays["split"].tolist(), arrays["sample"].tolist(), strict=True))
    possible["sample"] = possible["sample"] & (len(set(samples)) == len(samples))
    return possible


def joined(parts: Sequence[Registrations]) -> Registrations:
    """Return the registrations of several sources as one, with what is attached to all of them.

    Their samples are numbered anew within each split.
    """
    columns = {name: np.concatenate([getattr(part, name) for part in parts]) for name in REGISTRATION_COLUMNS}
    for split in SPLITS:
        rows = np.flatnonzero(columns["split"] == split)
        columns["sample"][rows] = np.arange(len(rows))
    clouds = [part.cloud(row) for part in parts for row in range(len(part))]
    targets = [part.target(row) for part in parts for row in range(len(part))]
    whole: dict[str, Any] = columns | ragged(clouds, targets)
    attached = {name: np.concatenate([part.attached[name] for part in parts]) for name in parts[0].attached}
    return Registrations(**whole, attached=attached)


def load_embeddings(
    path: str | Path, registrations: Registrations, shapes: Mapping[str, tuple[int | str, ...]]
) -> dict[str, np.ndarray]:
    """Read arrays of the registrations from a file of embeddings; see :func:`gpca.io.arrays.load_arrays`.

    Raises:
        InputError: also where the file is of other samples, or of another source or seed.
    """
    kinds = dict.fromkeys(shapes, REAL) | {"sample": WHOLE, "split": TEXT}
    arrays = load_arrays(path, {**shapes, "sample": ("S",), "split": ("S",)}, kinds, registrations.axes)
    if not all(np.array_equal(arrays[name], getattr(registrations, name)) for name in ("sample", "split")):
        raise InputError(path, "its samples differ from those of the registrations", REGENERATE)
    return arrays


def read_embedding(path: str | Path, registrations: Registrations, logits: bool = False) -> dict[str, np.ndarray]:
    """Read an encoder's arrays to attach to the registrations: ``embedding`` (S, d), if asked ``head_logits`` (S, C).

    Raises:
        InputError: as :func:`load_embeddings`.
    """
    shapes = {"h": ("S", "d")} | ({"head_logits": ("S", "C")} if logits else {})
    arrays = load_embeddings(path, registrations, shapes)
    return {"embedding": arrays["h"]} | ({"head_logits": arrays["head_logits"]} if logits else {})


def read_samples_of_frames(path: str | Path) -> pd.DataFrame:
    """Read the columns that tell samples apart, as text but for `in_training`."""
    rows = read_csv(path, SAMPLE_COLUMNS, others=FRAME_COLUMNS)
    return rows.assign(in_training=rows["in_training"] == "True")


def read_instances_of(path: str | Path, registrations: Registrations) -> np.ndarray:
    """Return the instance (S,) that each registration shows.

    Raises:
        InputError: the file is of other samples.
    """
    rows = read_samples_of_frames(path)
    for name in ("sample", "split"):
        if rows[name].tolist() != getattr(registrations, name).astype(str).tolist():
            raise InputError(
                path, "its samples differ from those of the registrations", "regenerate both from the same config"
            )
    return numbers(path, rows, "instance", least=0).to_numpy(int)


CLOUDS = ("points", "offsets", "target_points", "target_offsets")
_BESIDE = (*CLOUDS, "attached", "axes")
REGISTRATION_COLUMNS = tuple(field.name for field in fields(Registrations) if field.name not in _BESIDE)


def ragged(clouds: list[np.ndarray], targets: list[np.ndarray]) -> dict[str, np.ndarray]:
    """Return the four arrays of `CLOUDS` for the clouds and targets of all rows."""
    ends = [np.cumsum([0, *(len(cloud) for cloud in of_kind)], dtype=np.int64) for of_kind in (clouds, targets)]
    return dict(zip(CLOUDS, (np.concatenate(clouds), ends[0], np.concatenate(targets), ends[1]), strict=True))
