"""Registrations: perturbed pairs, aligned by ICP, labeled with their concept, and the file that holds them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from gpca.errors import InputError
from gpca.io.arrays import REAL, TEXT, WHOLE, load_arrays
from gpca.io.container import Container, array, require_same_samples
from gpca.io.csv_file import numbers, read_csv
from gpca.io.files import SPLITS
from gpca.io.frame import Frame
from gpca.objects.sizes import LARGEST_DIAMETER_M, SMALLEST_DIAMETER_M
from gpca.pairs.perturbation import CONCEPTS
from gpca.rigid import inverse, scale_translation, transform

FARTHEST = 1e3  # diameters from the target's center; a registration may fail, but nothing lies so far away
SAMPLE_COLUMNS = ("sample", "split", "instance", "dataset", "in_training")  # of the CSV beside registrations of frames
FRAME_COLUMNS = (
    *(*SAMPLE_COLUMNS, "concept", "scene", "image", "object", "symmetric", "init_from"),
    *("init_error", "icp_error", "lost_to"),
)
RIGID_TOLERANCE = 1e-2  # of a rotation's products with itself; datasets round their poses


@dataclass(frozen=True)
class Registrations(Container):
    """S registrations. Lengths are relative to the object's diameter unless the name ends in ``_m``."""

    names_axes: ClassVar[bool] = True

    sample: np.ndarray = array("S", WHOLE, least=0)  # its number within its split
    split: np.ndarray = array("S", TEXT)  # ``train`` or ``test``
    concept: np.ndarray = array("S", TEXT, choices=CONCEPTS)  # what was perturbed
    object_index: np.ndarray = array("S", WHOLE, least=0)
    object_name: np.ndarray = array("S", TEXT)
    diameter_m: np.ndarray = array("S", least=SMALLEST_DIAMETER_M, most=LARGEST_DIAMETER_M)
    cluster: np.ndarray = array("S", TEXT)  # of samples that are alike (:mod:`gpca.objects.canonical`)
    fold: np.ndarray = array("S", WHOLE)
    severity_noise: np.ndarray = array("S", least=0)  # each as drawn, 0 where not applied
    severity_rotation_rad: np.ndarray = array("S", least=0)
    severity_translation: np.ndarray = array("S", least=0)
    severity_crop: np.ndarray = array("S", least=0)
    T_target_source_true: np.ndarray = array("S 4 4")  # translations in meters
    T_target_source_init: np.ndarray = array("S 4 4")
    T_target_source_icp: np.ndarray = array("S 4 4")
    fitness: np.ndarray = array("S", least=0, most=1)
    inlier_rmse: np.ndarray = array("S", least=0)
    # ICP-aligned source clouds, and clean targets in the same frame, one after another: :meth:`cloud`, :meth:`target`
    points: np.ndarray = array("P 3", offsets="offsets", fewest=3, least=-FARTHEST, most=FARTHEST)
    offsets: np.ndarray = array("S+1", WHOLE)
    target_points: np.ndarray = array("Q 3", offsets="target_offsets", fewest=3, least=-FARTHEST, most=FARTHEST)
    target_offsets: np.ndarray = array("S+1", WHOLE)
    attached: Mapping[str, np.ndarray] = field(default_factory=dict)  # (S, …) of other files: ``embedding``, …

    def cloud(self, i: int) -> np.ndarray:
        """Return the aligned source cloud (P, 3) of row i."""
        return self.part("points", i)

    def target(self, i: int) -> np.ndarray:
        """Return the target cloud (Q, 3) of row i."""
        return self.part("target_points", i)

    def source(self, i: int) -> np.ndarray:
        """Return the source cloud (P, 3) of row i before ICP."""
        return transform(inverse(self.T_target_source("icp", i)), self.cloud(i).astype(np.float64))

    def T_target_source(self, which: str, i: int) -> np.ndarray:
        """Return the pose ``init``, ``icp`` or ``true`` of row i in diameters, the unit of the clouds."""
        return scale_translation(getattr(self, f"T_target_source_{which}")[i], 1 / self.diameter_m[i])

    @property
    def embedding(self) -> np.ndarray:
        """The attached embedding (S, d) of an encoder."""
        return self.attached["embedding"]

    def rows(self, split: str) -> np.ndarray:
        """Return the row numbers of a split."""
        return np.flatnonzero(self.split == split)

    def subset(self, rows: np.ndarray) -> Registrations:
        """Return the given rows with their attached arrays."""
        return replace(super().subset(rows), attached={name: array[rows] for name, array in self.attached.items()})

    @classmethod
    def joined(cls, parts: Sequence[Registrations]) -> Registrations:
        """Return the registrations of several sources as one, their samples renumbered within each split."""
        whole = super().joined(parts)
        sample_S = whole.sample.copy()
        for split in SPLITS:
            rows = whole.rows(split)
            sample_S[rows] = np.arange(len(rows))
        attached = {name: np.concatenate([part.attached[name] for part in parts]) for name in parts[0].attached}
        return replace(whole, sample=sample_S, attached=attached)

    def without_labels(self) -> Registrations:
        """Return the registrations as explainers may see them, without traces of the perturbation."""
        nan_S = np.full(len(self), np.nan)
        unknown: dict[str, Any] = {name: nan_S for name in REGISTRATION_COLUMNS if name.startswith("severity_")}
        unknown["T_target_source_true"] = np.full_like(self.T_target_source_true, np.nan)
        return replace(self, concept=np.full(len(self), ""), **unknown)

    def check(self, path: str | Path) -> None:
        """Raise an InputError also where a sample occurs twice, or a pose is not rigid or out of reach."""
        super().check(path)
        reach_m = FARTHEST * LARGEST_DIAMETER_M  # cameras are no farther from what they see, either
        for name, T_S_4_4 in self.arrays.items():
            if name.startswith("T_"):
                R_S_3_3 = T_S_4_4[:, :3, :3]
                off_S_3_3 = np.abs(np.einsum("sij,skj->sik", R_S_3_3, R_S_3_3) - np.eye(3))
                rigid = off_S_3_3.max() < RIGID_TOLERANCE and (np.linalg.det(R_S_3_3) > 0).all()
                near = (np.abs(T_S_4_4[:, :3, 3]) <= reach_m).all()
                if not (rigid and near and (T_S_4_4[:, 3] == (0, 0, 0, 1)).all()):
                    raise InputError(path, f"'{name}' contains impossible values", self.remedy)
        if len(set(zip(self.split.tolist(), self.sample.tolist(), strict=True))) < len(self):
            raise InputError(path, "'sample' contains impossible values", self.remedy)


def load_embeddings(
    path: str | Path, registrations: Registrations, shapes: Mapping[str, tuple[int | str, ...]]
) -> dict[str, np.ndarray]:
    """Read arrays of a file of embeddings; InputError where it has other samples, or another source or seed."""
    kinds = dict.fromkeys(shapes, REAL) | {"sample": WHOLE, "split": TEXT}
    arrays = load_arrays(path, {**shapes, "sample": ("S",), "split": ("S",)}, kinds, registrations.axes)
    require_same_samples(path, arrays, registrations.arrays)
    return arrays


def read_embedding(path: str | Path, registrations: Registrations, logits: bool = False) -> dict[str, np.ndarray]:
    """Read arrays to attach: ``embedding`` (S, d) and, with `logits`, ``head_logits`` (S, C); InputError as above."""
    shapes = {"h": ("S", "d")} | ({"head_logits": ("S", "C")} if logits else {})
    arrays = load_embeddings(path, registrations, shapes)
    return {"embedding": arrays["h"]} | ({"head_logits": arrays["head_logits"]} if logits else {})


def read_samples_of_frames(path: str | Path) -> Frame:
    """Read the columns that identify samples of frames, as text but for `in_training`."""
    rows = read_csv(path, SAMPLE_COLUMNS, others=FRAME_COLUMNS)
    return rows.assign(in_training=rows["in_training"] == "True")


def read_instances_of(path: str | Path, registrations: Registrations) -> np.ndarray:
    """Return the instance (S,) of each registration; InputError where the file has other samples."""
    rows = read_samples_of_frames(path)
    require_same_samples(path, rows, registrations.arrays)
    return numbers(path, rows, "instance", least=0).to_numpy(int)


CLOUDS = ("points", "offsets", "target_points", "target_offsets")
REGISTRATION_COLUMNS = tuple(name for name in Registrations.array_fields() if name not in CLOUDS)


def ragged(clouds: list[np.ndarray], targets: list[np.ndarray]) -> dict[str, Any]:
    """Return the four arrays of `CLOUDS` for the clouds and targets of all rows."""
    ends = [np.cumsum([0, *(len(cloud) for cloud in each)], dtype=np.int64) for each in (clouds, targets)]
    return dict(zip(CLOUDS, (np.concatenate(clouds), ends[0], np.concatenate(targets), ends[1]), strict=True))
