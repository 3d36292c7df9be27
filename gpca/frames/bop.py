"""Frames of a dataset in the layout of the BOP benchmark: depth, colour, masks, true poses.

Format: https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md. Lengths are millimetres in the
files and metres here; cameras look along +z with x to the right and y down.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gpca.alignment.rigid import require_rotation
from gpca.errors import InputError
from gpca.files import read_image

FEWEST_POINTS = 64
REMEDY = "the folder may be half unpacked: unpack the dataset anew"


@dataclass(frozen=True)
class Annotation:
    """One object in a frame: its id, its true pose in metres, and the mask of its visible part."""

    object_id: int
    T_camera_model: np.ndarray
    mask: Path


@dataclass(frozen=True)
class Frame:
    """One image of a scene.

    Attributes:
        scene, image: numbers, as the folder and its files are named.
        camera_3_3: K, in pixels.
        depth_scale: millimetres per unit of the depth image.
        depth, colour: files.
        annotations: the objects in it.
    """

    scene: int
    image: int
    camera_3_3: np.ndarray
    depth_scale: float
    depth: Path
    colour: Path
    annotations: tuple[Annotation, ...]

    def depth_m(self) -> np.ndarray:
        """Return depth (H, W) in metres, 0 where nothing was measured.

        Raises:
            InputError: missing or unreadable image, colours instead of depth, no measurement at all.
        """
        depth_H_W = read_image(self.depth, REMEDY)
        if depth_H_W.ndim != 2:
            raise InputError(self.depth, "is a colour image, not depth", REMEDY)
        if not depth_H_W.any():
            raise InputError(self.depth, "holds no depth: every pixel is 0", "leave the image out, or fetch it anew")
        return depth_H_W * np.float32(self.depth_scale / 1000)

    def mask(self, annotation: Annotation) -> np.ndarray:
        """Return the visible part (H, W) of an object as booleans; InputError for a missing or unreadable mask."""
        mask = read_image(annotation.mask, REMEDY)
        return (mask if mask.ndim == 2 else mask[..., 0]) > 0


def read_frames(folders: Iterable[Path], split: str = "test") -> list[Frame]:
    """Return the frames of a dataset in order of scene and image.

    Args:
        folders: the dataset's folder, or those that its archives were unpacked in.
        split: its subfolder begins with this.

    Raises:
        InputError: no scenes, missing or damaged JSON file, an image without camera or depth file, a pose that is no
            rotation, an object without a mask.
    """
    folders = list(folders)
    found = [path for folder in folders for path in folder.glob(f"**/{split}*/*/scene_gt.json")]
    if not found:
        raise InputError(
            ", ".join(map(str, folders)), f"holds no {split}*/<scene>/scene_gt.json", "check location, or split"
        )
    frames = [frame for path in found for frame in _frames_of_scene(path.parent)]
    return sorted(frames, key=lambda frame: (frame.scene, frame.image))


def back_project(depth_m: np.ndarray, mask: np.ndarray, camera_3_3: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the measured points (P, 3) of a mask in the camera's frame, metres, and their pixels (P, 2) as (u, v).

    Pixel centres have whole coordinates: x = (u - c_x) z / f_x.
    """
    v, u = np.nonzero(mask & (depth_m > 0))
    z = depth_m[v, u].astype(np.float64)
    (fx, skew, cx), (_, fy, cy), _ = camera_3_3
    y = (v - cy) / fy
    x = (u - cx - skew * y) / fx
    return np.stack([x * z, y * z, z], axis=1), np.stack([u, v], axis=1)


def visible_points(
    frame: Frame, annotation: Annotation, depth_m: np.ndarray, diameter_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return an object's measured points (P, 3) and their pixels (P, 2).

    What is farther than a diameter from the points' median cannot be the object: a mask's rim sees what is behind.

    Raises:
        InputError: mask and depth of different sizes, or fewer than `FEWEST_POINTS` points.
    """
    mask = frame.mask(annotation)
    if mask.shape != depth_m.shape:
        sizes = " but depth is ".join("×".join(map(str, shape[::-1])) for shape in (mask.shape, depth_m.shape))
        raise InputError(annotation.mask, f"is {sizes}", REMEDY)
    points, pixels = back_project(depth_m, mask, frame.camera_3_3)
    if len(points):
        near = np.linalg.norm(points - np.median(points, axis=0), axis=1) <= diameter_m
        points, pixels = points[near], pixels[near]
    if len(points) < FEWEST_POINTS:
        raise TooFewPoints(
            annotation.mask, f"has depth at {len(points)} pixel(s)", f"{FEWEST_POINTS} are needed: leave it out"
        )
    return points, pixels


class TooFewPoints(InputError):
    """An object of which next to nothing was measured; datasets have such, and a reader may go on without it."""


def _frames_of_scene(folder: Path) -> list[Frame]:
    cameras, truths = (_by_image(folder / f"scene_{name}.json") for name in ("camera", "gt"))
    frames = []
    for image, truth in truths.items():
        if image not in cameras:
            raise InputError(folder / "scene_camera.json", f"has no image {image}", REMEDY)
        try:
            camera = np.array(cameras[image]["cam_K"], float).reshape(3, 3)
            scale = float(cameras[image]["depth_scale"])
        except (KeyError, TypeError, ValueError) as fault:
            raise InputError(
                folder / "scene_camera.json", f"image {image} has no proper cam_K and depth_scale", REMEDY
            ) from fault
        frames.append(
            Frame(
                scene=int(folder.name),
                image=image,
                camera_3_3=camera,
                depth_scale=scale,
                depth=_image(folder / "depth", f"{image:06d}"),
                colour=_image(folder / ("rgb" if (folder / "rgb").is_dir() else "gray"), f"{image:06d}"),
                annotations=tuple(_annotation(folder, image, n, entry) for n, entry in enumerate(truth)),
            )
        )
    return frames


def _annotation(folder: Path, image: int, n: int, entry: dict) -> Annotation:
    subject = f"{folder / 'scene_gt.json'}: image {image}, object {n}"
    try:
        T_camera_model = np.eye(4)
        T_camera_model[:3, :3] = np.reshape(entry["cam_R_m2c"], (3, 3))
        T_camera_model[:3, 3] = np.array(entry["cam_t_m2c"], float) / 1000
        object_id = int(entry["obj_id"])
    except (KeyError, TypeError, ValueError) as fault:
        raise InputError(subject, "has no proper cam_R_m2c, cam_t_m2c and obj_id", REMEDY) from fault
    require_rotation(T_camera_model, subject)
    return Annotation(object_id, T_camera_model, _image(folder / "mask_visib", f"{image:06d}_{n:06d}"))


def _by_image(path: Path) -> dict[int, dict]:
    if not path.is_file():
        raise InputError(path, "no such file", REMEDY)
    try:
        return {int(image): entry for image, entry in json.loads(path.read_text(encoding="utf-8")).items()}
    except (ValueError, AttributeError) as fault:
        raise InputError(path, "is not a scene's JSON file", REMEDY) from fault


def _image(folder: Path, stem: str) -> Path:
    for suffix in (".png", ".jpg", ".jpeg", ".tif"):
        if (path := folder / f"{stem}{suffix}").is_file():
            return path
    raise InputError(folder / f"{stem}.png", "no such image", REMEDY)
