"""Instances: objects as single depth frames show them, with their true and their initial poses, and their file."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.files import load_arrays, save_arrays
from gpca.seeds import generator

MADE_BY = "python -m gpca instances"


@dataclass(frozen=True)
class Instances:
    """I objects in frames. The object frame is that of the canonical cloud, centred on its bounding box.

    Attributes:
        dataset, scene, image: (I,) where the instance was seen.
        group: (I,) frames that show nearly the same have the same number; no group is in both training and test.
        object_index: (I,) of the objects npz beside this file.
        symmetric: (I,) a rotation exists that changes nothing about the object's shape.
        T_camera_object_true, T_camera_object_init: (I, 4, 4), metres.
        camera_3_3: (I, 3, 3) K in pixels.
        colour: (I,) path of the colour image.
        points_m: (ΣP, 3) float32, measured points in the camera's frame; those of instance i are
            ``points_m[offsets[i]:offsets[i + 1]]``.
        pixels: (ΣP, 2) int32, where each was seen, (u, v).
    """

    dataset: np.ndarray
    scene: np.ndarray
    image: np.ndarray
    group: np.ndarray
    object_index: np.ndarray
    symmetric: np.ndarray
    T_camera_object_true: np.ndarray
    T_camera_object_init: np.ndarray
    camera_3_3: np.ndarray
    colour: np.ndarray
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

    def split(self, source: str, seed: int, test_share: float) -> dict[str, np.ndarray]:
        """Return the rows of ``train`` and ``test``: whole groups, in an order of the seed's, until the share is met.

        Raises:
            InputError: all frames are of one group.
        """
        groups = generator(source, seed, "split").permutation(np.unique(self.group))
        if len(groups) < 2:
            raise InputError(f"instances of {source}", "all are of one group of frames", "give frames of two scenes")
        sizes_G = np.array([np.sum(self.group == group) for group in groups])
        n_test = 1 + int(np.sum(np.cumsum(sizes_G)[:-1] < test_share * len(self)))
        is_test = np.isin(self.group, groups[: min(n_test, len(groups) - 1)])
        return {"train": np.flatnonzero(~is_test), "test": np.flatnonzero(is_test)}

    def save(self, path: str | Path) -> None:
        """Write the npz described in results/README.md."""
        save_arrays(path, {field.name: getattr(self, field.name) for field in fields(self)})

    @classmethod
    def load(cls, path: str | Path) -> Instances:
        """Read the npz; InputError where it is missing, damaged or inconsistent."""
        shapes: dict[str, tuple[int | str, ...]] = {field.name: ("I",) for field in fields(cls)}
        shapes |= {name: ("I", 4, 4) for name in shapes if name.startswith("T_")}
        shapes |= {"camera_3_3": ("I", 3, 3), "points_m": ("P", 3), "pixels": ("P", 2), "offsets": ("O",)}
        arrays = load_arrays(path, shapes, MADE_BY)
        offsets = arrays["offsets"]
        whole = len(offsets) == len(arrays["scene"]) + 1 and offsets[0] == 0 and offsets[-1] == len(arrays["points_m"])
        if not whole or len(offsets) == 1 or (np.diff(offsets) < 3).any():
            raise InputError(path, "'offsets' do not match 'points_m' and 'scene'", f"make it anew with '{MADE_BY}'")
        return cls(**{name: arrays[name] for name in shapes})


def groups_of_frames(scene_F: np.ndarray, image_F: np.ndarray, gap: int) -> np.ndarray:
    """Return a number for each frame: the same for images of a scene that follow each other within `gap`.

    Images are numbered in the order of recording, so that neighbours show nearly the same.
    """
    order = np.lexsort((image_F, scene_F))
    new_F = np.ones(len(order), bool)
    new_F[1:] = (np.diff(scene_F[order]) != 0) | (np.diff(image_F[order]) > gap)
    group_F = np.empty(len(order), int)
    group_F[order] = np.cumsum(new_F) - 1
    return group_F
