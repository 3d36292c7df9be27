"""Frames of a dataset in the layout of the BOP benchmark: depth, color, masks, true poses.

Format: https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md. Lengths are millimeters in the
files and meters here; cameras look along +z with x to the right and y down.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.frames.scene_files import REMEDY, read_camera, read_images, read_pose
from gpca.io.files import read_image
from gpca.numerals import whole

FEWEST_POINTS = 64


@dataclass(frozen=True)
class Annotation:
    """One object in a frame: its id, its true pose in meters, the mask of its visible part, and where that stands."""

    object_id: int
    T_camera_model: np.ndarray
    mask: Path
    subject: str


@dataclass(frozen=True)
class Frame:
    """One image of a scene.

    Attributes:
        scene, image: numbers, as the folder and its files are named.
        camera_3_3: K, in pixels.
        depth_scale: millimeters per unit of the depth image.
        depth, color: files; a frame need not have colors.
        annotations: the objects in it.
    """

    scene: int
    image: int
    camera_3_3: np.ndarray
    depth_scale: float
    depth: Path
    color: Path | None
    annotations: tuple[Annotation, ...]

    @property
    def place(self) -> tuple[int, int]:
        """Scene and image."""
        return self.scene, self.image

    def depth_m(self) -> np.ndarray:
        """Return depth (H, W) in meters, 0 where nothing was measured.

        Raises:
            InputError: missing or unreadable image, colors instead of depth, 8 bits, negative or infinite depth, no
                measurement at all.
        """
        depth_H_W = read_image(self.depth, REMEDY)
        if depth_H_W.ndim != 2:
            raise InputError(self.depth, "is a color image, not depth", REMEDY)
        if depth_H_W.dtype.itemsize == 1:
            raise InputError(self.depth, "is 8-bit depth: 16 bits expected", "export it again without conversion")
        if (depth_H_W < 0).any() or np.isinf(depth_H_W).any():  # NaN is a usual mark of what was not measured
            raise InputError(self.depth, "contains negative or infinite depth", "write 0 where nothing was measured")
        if not (depth_H_W > 0).any():
            raise InputError(self.depth, "has no depth: every pixel is 0", "leave the image out, or fetch it again")
        return depth_H_W * np.float32(self.depth_scale / 1000)

    def mask(self, annotation: Annotation) -> np.ndarray:
        """Return the visible part (H, W) of an object as booleans.

        Raises:
            InputError: missing or unreadable image, or one of many values: a picture, or numbers of objects.
        """
        mask = read_image(annotation.mask, REMEDY)
        mask = mask if mask.ndim == 2 else mask[..., 0]
        inside = mask > 0
        # A tenth, because the rim of a small mask that was resized or saved as JPEG has values in between.
        if inside.any() and 10 * np.unique(mask[inside], return_counts=True)[1].max() < inside.sum():
            raise InputError(
                annotation.mask, "is not a mask: most of its pixel values differ", "write 0 outside, 255 inside"
            )
        return inside


def read_frames(folders: Iterable[Path], split: str = "test") -> list[Frame]:
    """Return the frames of a dataset in order of scene and image.

    Args:
        folders: the dataset's folder, or those that its archives were unpacked in.
        split: its subfolder begins with this.

    Raises:
        InputError: no scenes, missing or damaged JSON file, an image without camera or depth file, a camera or pose
            that cannot be, an object without a mask, two folders of one scene.
    """
    folders = list(folders)
    scene_files = [path for folder in folders for path in folder.glob(f"**/{split}*/*/scene_gt.json")]
    if not scene_files:
        raise InputError(
            ", ".join(map(str, folders)), f"has no {split}*/<scene>/scene_gt.json", "check location or split"
        )
    frames = [frame for path in scene_files for frame in _frames_of_scene(path.parent)]
    if not frames:
        raise InputError(scene_files[0], "lists no image", REMEDY)
    first: dict[tuple[int, int], Frame] = {}
    for frame in frames:
        if (same := first.setdefault((frame.scene, frame.image), frame)) is not frame:
            both = f"{same.depth} and {frame.depth}"
            raise InputError(both, "are the same image of the same scene", "set split to the intended folder")
    return sorted(frames, key=lambda frame: (frame.scene, frame.image))


def back_project(depth_m: np.ndarray, mask: np.ndarray, camera_3_3: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the measured points (P, 3) of a mask in the camera's frame, meters, and their pixels (P, 2) as (u, v).

    Pixel centers have whole coordinates: x = (u - c_x) z / f_x.
    """
    v, u = np.nonzero(mask & (depth_m > 0))
    z = depth_m[v, u].astype(np.float64)
    (fx, skew, cx), (_, fy, cy), _ = camera_3_3
    y = (v - cy) / fy
    x = (u - cx - skew * y) / fx
    return np.stack([x * z, y * z, z], axis=1), np.stack([u, v], axis=1)


def measured_points(frame: Frame, annotation: Annotation, depth_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what was measured within an object's mask, points (P, 3) and their pixels (P, 2).

    Raises:
        InputError: mask and depth of different sizes.
        TooFewPoints: fewer than `FEWEST_POINTS`.
    """
    mask = frame.mask(annotation)
    if mask.shape != depth_m.shape:
        sizes = " but depth is ".join("×".join(map(str, shape[::-1])) for shape in (mask.shape, depth_m.shape))
        raise InputError(annotation.mask, f"is {sizes}", REMEDY)
    points, pixels = back_project(depth_m, mask, frame.camera_3_3)
    _require_points(points, annotation)
    return points, pixels


def without_background(
    points: np.ndarray, pixels: np.ndarray, annotation: Annotation, diameter_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return an object's points (P, 3) and their pixels (P, 2); TooFewPoints where fewer than `FEWEST_POINTS` remain.

    What is farther than a diameter from the points' median cannot be the object: a mask's rim sees what is behind.
    """
    near = np.linalg.norm(points - np.median(points, axis=0), axis=1) <= diameter_m
    _require_points(points[near], annotation)
    return points[near], pixels[near]


def _require_points(points: np.ndarray, annotation: Annotation) -> None:
    if len(points) < FEWEST_POINTS:
        raise TooFewPoints(
            annotation.mask,
            f"has depth at {len(points)} pixel(s)",
            f"leave it out: at least {FEWEST_POINTS} are needed",
        )


class TooFewPoints(InputError):
    """An object of which next to nothing was measured; datasets have such, and a reader may go on without it."""


def _frames_of_scene(folder: Path) -> list[Frame]:
    try:
        scene = whole(folder.name)
    except ValueError as fault:
        raise InputError(folder, "the name of a scene's folder is not a number", "name it like 000001") from fault
    cameras, truths = (read_images(folder / f"scene_{name}.json") for name in ("camera", "gt"))
    colors = folder / ("rgb" if (folder / "rgb").is_dir() else "gray")
    frames = []
    for image, truth in truths.items():
        if image not in cameras:
            raise InputError(folder / "scene_camera.json", f"has no image {image}", REMEDY)
        if not isinstance(truth, list):
            raise InputError(folder / "scene_gt.json", f"image {image} has no list of objects", REMEDY)
        camera_3_3, depth_scale = read_camera(cameras[image], f"{folder / 'scene_camera.json'}: image {image}")
        frames.append(
            Frame(
                scene=scene,
                image=image,
                camera_3_3=camera_3_3,
                depth_scale=depth_scale,
                depth=_image(folder / "depth", f"{image:06d}"),
                color=_image_if_any(colors, f"{image:06d}"),
                annotations=tuple(_annotation(folder, image, n, entry) for n, entry in enumerate(truth)),
            )
        )
    return frames


def _annotation(folder: Path, image: int, n: int, entry: object) -> Annotation:
    subject = f"{folder / 'scene_gt.json'}: image {image}, object {n}"
    object_id, T_camera_model = read_pose(entry, subject)
    return Annotation(object_id, T_camera_model, _image(folder / "mask_visib", f"{image:06d}_{n:06d}"), subject)


def _image(folder: Path, stem: str) -> Path:
    if (path := _image_if_any(folder, stem)) is not None:
        return path
    raise InputError(folder / f"{stem}.png", "no such image", REMEDY)


def _image_if_any(folder: Path, stem: str) -> Path | None:
    paths = (folder / f"{stem}{suffix}" for suffix in (".png", ".jpg", ".jpeg", ".tif"))
    return next((path for path in paths if path.is_file()), None)
