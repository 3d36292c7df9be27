"""Instances: objects as single depth frames show them, with their true and their initial poses, and their file.

Beside registrations of depth frames lies a CSV that says which instance each sample shows, and its pose errors.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError
from gpca.frames.sighting import Sighting
from gpca.io.arrays import REGENERATE, TEXT, WHOLE, load_arrays, save_arrays
from gpca.io.csv_file import numbers, read_csv
from gpca.objects.splits import DRAWN, unseen
from gpca.pairs.dataset import Registrations
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

NO_COLOR = "none"
COLUMNS = ("sample", "split", "instance", "dataset", "in_training")
FRAME_COLUMNS = (  # all that the file may hold
    *COLUMNS,
    *("concept", "scene", "image", "object", "symmetric", "init_from", "init_error", "icp_error", "lost_to"),
)


@dataclass(frozen=True)
class Instances:
    """I objects in frames. The object frame is that of the canonical cloud, centered on its bounding box.

    Attributes:
        dataset, scene, image: (I,) where the instance was seen.
        object_index: (I,) of the objects npz beside this file.
        symmetric: (I,) a rotation exists that changes nothing about the object's shape.
        T_camera_object_true, T_camera_object_init: (I, 4, 4), meters.
        init_from: (I,) where the initial pose is from: an estimator, ``errors`` of estimators, or another form.
        camera_3_3: (I, 3, 3) K in pixels.
        colour: (I,) path of the color image; `NO_COLOR` where there is none.
        fold: (I,) that the scene is tested with, `DRAWN` or `TRAINING` (:mod:`gpca.objects.splits`).
        points_m: (ΣP, 3) float32, measured points in the camera's frame; those of instance i are
            ``points_m[offsets[i]:offsets[i + 1]]``.
        pixels: (ΣP, 2) int32, where each was seen, (u, v).
    """

    dataset: np.ndarray
    scene: np.ndarray
    image: np.ndarray
    object_index: np.ndarray
    symmetric: np.ndarray
    T_camera_object_true: np.ndarray
    T_camera_object_init: np.ndarray
    init_from: np.ndarray
    camera_3_3: np.ndarray
    colour: np.ndarray
    fold: np.ndarray
    points_m: np.ndarray
    pixels: np.ndarray
    offsets: np.ndarray

    def __len__(self) -> int:
        return len(self.scene)

    def cloud_m(self, i: int) -> np.ndarray:
        """Return the measured points (P, 3) of instance i."""
        return self.points_m[self.offsets[i] : self.offsets[i + 1]]

    def pixels_of(self, i: int) -> np.ndarray:
        """Return the pixels (P, 2) of instance i."""
        return self.pixels[self.offsets[i] : self.offsets[i + 1]]

    def sighting(self, i: int) -> Sighting:
        """Return what was measured of instance i."""
        return Sighting(self.cloud_m(i).astype(np.float64), self.pixels_of(i), self.camera_3_3[i])

    @property
    def is_colored(self) -> np.ndarray:
        """(I,) the frame has a color image."""
        return self.colour != NO_COLOR

    @property
    def cluster(self) -> np.ndarray:
        """(I,) the scene: its frames show the same objects in the same places."""
        return np.array([f"{dataset} {scene}" for dataset, scene in zip(self.dataset, self.scene, strict=True)])

    def split(self, source: str, seed: int, test_share: float) -> dict[str, np.ndarray]:
        """Return the rows of ``train`` and ``test``: whole scenes, as one in training would give another frame away.

        The seed's fold is tested. Of scenes without a fold, so many as hold the share, in an order of the seed's.

        Raises:
            InputError: all frames are of one scene.
        """
        by_fold = unseen(self.fold, seed)
        is_test = np.zeros(len(self), bool) if by_fold is None else by_fold
        is_drawn = self.fold == DRAWN
        is_test[is_drawn] = self._drawn(is_drawn, source, seed, test_share)
        if is_test.all() or not is_test.any():
            raise InputError(f"instances of {source}", "all are from one scene", "give frames from at least two scenes")
        return {"train": np.flatnonzero(~is_test), "test": np.flatnonzero(is_test)}

    def _drawn(self, rows: np.ndarray, source: str, seed: int, test_share: float) -> np.ndarray:
        """Return which of the rows are in scenes that are drawn for testing: a share, at least one scene, never all."""
        _, scene_n = np.unique(self.cluster[rows], return_inverse=True)
        scenes = generator(source, seed, "split").permutation(len(np.unique(scene_n)))
        sizes_G = np.bincount(scene_n, minlength=len(scenes))[scenes]
        n_test = 1 + int(np.sum(np.cumsum(sizes_G)[:-1] < test_share * len(scene_n)))
        return np.isin(scene_n, scenes[: min(n_test, len(scenes) - 1)])

    def save(self, path: str | Path, source: str) -> None:
        """Write the npz described in results/README.md."""
        save_arrays(path, {field.name: getattr(self, field.name) for field in fields(self)}, (source, None))

    @classmethod
    def load(cls, path: str | Path, source: str | None = None) -> Instances:
        """Read the npz; InputError where it is missing, damaged, inconsistent or of another source than this."""
        shapes: dict[str, tuple[int | str, ...]] = {field.name: ("I",) for field in fields(cls)}
        shapes |= {name: ("I", 4, 4) for name in shapes if name.startswith("T_")}
        shapes |= {"camera_3_3": ("I", 3, 3), "points_m": ("P", 3), "pixels": ("P", 2), "offsets": ("O",)}
        kinds = dict.fromkeys(shapes, WHOLE) | dict.fromkeys(("camera_3_3", "points_m"), "f")
        kinds |= {name: "f" for name in shapes if name.startswith("T_")}
        kinds |= dict.fromkeys(("dataset", "colour", "init_from"), TEXT) | {"symmetric": "b"}
        arrays = load_arrays(path, shapes, kinds, None if source is None else (source, None))
        offsets = arrays["offsets"]
        whole = len(offsets) == len(arrays["scene"]) + 1 and offsets[0] == 0 and offsets[-1] == len(arrays["points_m"])
        if not whole or len(offsets) == 1 or (np.diff(offsets) < 3).any():
            raise InputError(path, "'offsets' do not match 'points_m' and 'scene'", REGENERATE)
        return cls(**{name: arrays[name] for name in shapes})


def read_samples_of_frames(path: str | Path) -> pd.DataFrame:
    """Read the columns that tell samples apart, as text but for `in_training`."""
    rows = read_csv(path, COLUMNS, others=FRAME_COLUMNS)
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
