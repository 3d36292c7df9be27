"""Depth frames in the layout of the BOP benchmark, lengths in meters instead of millimeters."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gpca.errors import InputError, refusing
from gpca.io.files import read_image
from gpca.io.structured_text import finite_numbers, read_json
from gpca.numerals import whole
from gpca.objects.camera import back_project
from gpca.rigid import require_rotation, rigid_motion

REMEDY = "the folder may be half unpacked: unpack the dataset again"
# Far beyond those of all depth cameras; wrong values within these limits show in the measured points.
FOCAL_PX = (1.0, 1e6)
DEPTH_SCALES = (1e-6, 1e6)  # millimeters per unit: from nanometers to kilometers
FARTHEST_MM = 1e6
FEWEST_POINTS = 64


def read_images(path: Path) -> dict[int, Any]:
    """Return the entries of scene_camera.json or scene_gt.json by image number; InputError for a faulty file."""
    images: dict[int, Any] = {}
    for key, entry in read_json(path, "a scene's JSON file", REMEDY).items():
        with refusing(path, f"its key {key[:40]!r} is not an image number", REMEDY):
            image = whole(key)
        if image in images:
            raise InputError(path, f"image {image} occurs twice", "keep one of the two")
        images[image] = entry
    return images


def read_camera(entry: Any, subject: str) -> tuple[np.ndarray, float]:
    """Return K (3, 3) in pixels and the millimeters per unit of depth; InputError for impossible values."""
    camera_3_3, matrix_subject = _numbers(entry, "cam_K", 9, subject).reshape(3, 3), f"{subject}: cam_K"
    if abs(camera_3_3[[1, 2, 2], [0, 0, 1]]).max() > 1e-6 or abs(camera_3_3[2, 2] - 1) > 1e-6:
        raise InputError(matrix_subject, "is not a camera matrix", "give fx s cx, 0 fy cy, 0 0 1, row by row")
    focal_px, (nearest_px, farthest_px) = np.diag(camera_3_3)[:2], FOCAL_PX
    if focal_px.min() < nearest_px or abs(camera_3_3[:2]).max() > farthest_px:
        fault = f"has the focal lengths {focal_px[0]:.6g} and {focal_px[1]:.6g} px"
        raise InputError(matrix_subject, f"{fault}, or a principal point outside any image", "give them in pixels")
    (scale,) = _numbers(entry, "depth_scale", 1, subject)
    if not DEPTH_SCALES[0] <= scale <= DEPTH_SCALES[1]:
        raise InputError(subject, f"depth_scale is {scale:.6g}", "give the millimeters per unit of the depth images")
    return camera_3_3, float(scale)


def read_pose(entry: Any, subject: str) -> tuple[int, np.ndarray]:
    """Return an annotation's object id and ``T_camera_model`` in meters; InputError for impossible values."""
    R_camera_model = _numbers(entry, "cam_R_m2c", 9, subject).reshape(3, 3)
    translation_mm = _numbers(entry, "cam_t_m2c", 3, subject)
    if abs(translation_mm).max() > FARTHEST_MM:
        raise InputError(subject, f"cam_t_m2c is {abs(translation_mm).max():.3g} mm", "no camera sees that far")
    T_camera_model = rigid_motion(R_camera_model, translation_mm / 1000)
    require_rotation(T_camera_model, subject)
    (object_id,) = _numbers(entry, "obj_id", 1, subject)
    if object_id < 0 or object_id > 999_999 or object_id != int(object_id):  # files of models have six digits
        raise InputError(subject, f"obj_id is {object_id:.6g}", "ids are whole numbers of at most six digits")
    return int(object_id), T_camera_model


def _numbers(entry: Any, key: str, count: int, subject: str) -> np.ndarray:
    if not isinstance(entry, dict) or key not in entry:
        raise InputError(subject, f"has no {key}", REMEDY)
    return finite_numbers(entry[key], count, subject, key, REMEDY)


@dataclass(frozen=True)
class Annotation:
    """An object in a frame: id, true pose in meters, mask of the visible part, and where its annotation stands."""

    object_id: int
    T_camera_model: np.ndarray
    mask: Path
    subject: str


@dataclass(frozen=True)
class Frame:
    """One image of a scene; the numbers of both are those of their folder and files."""

    scene: int
    image: int
    camera_3_3: np.ndarray
    depth_scale: float  # millimeters per unit of the depth image
    depth: Path
    color: Path | None  # a frame may lack colors
    annotations: tuple[Annotation, ...]

    @property
    def place(self) -> tuple[int, int]:
        """Scene and image."""
        return self.scene, self.image

    def depth_m(self) -> np.ndarray:
        """Return depth (H, W) in meters, 0 where nothing was measured; InputError unless the image has 16-bit depth."""
        depth_H_W = read_image(self.depth, REMEDY)
        if depth_H_W.ndim != 2 or depth_H_W.dtype.itemsize == 1:
            raise InputError(self.depth, "is color or 8-bit, not 16-bit depth", "export it again without conversion")
        if (depth_H_W < 0).any() or np.isinf(depth_H_W).any():  # NaN is a usual mark of what was not measured
            raise InputError(self.depth, "contains negative or infinite depth", "write 0 where nothing was measured")
        if not (depth_H_W > 0).any():
            raise InputError(self.depth, "has no depth: every pixel is 0", "leave the image out, or fetch it again")
        return depth_H_W * np.float32(self.depth_scale / 1000)

    def mask(self, annotation: Annotation) -> np.ndarray:
        """Return the visible part (H, W) of an object as booleans; InputError for a picture, or numbers of objects."""
        mask = read_image(annotation.mask, REMEDY)
        mask = mask if mask.ndim == 2 else mask[..., 0]
        inside = mask > 0
        # A tenth, because the rim of a small mask that was resized or saved as JPEG has values in between.
        if inside.any() and 10 * np.unique(mask[inside], return_counts=True)[1].max() < inside.sum():
            fault = "is not a mask: most of its pixel values differ"
            raise InputError(annotation.mask, fault, "write 0 outside, 255 inside")
        return inside


def scene_files(folders: Iterable[Path], split: str = "test") -> Iterator[Path]:
    """Yield the scene_gt.json of each scene below ``{split}*`` of a dataset's folders; InputError if none is there."""
    folders, path = list(folders), None
    for folder in folders:
        for path in folder.glob(f"**/{split}*/*/scene_gt.json"):
            yield path
    if path is None:
        fault = f"has no {split}*/<scene>/scene_gt.json"
        raise InputError(", ".join(map(str, folders)), fault, "check location or split")


def read_frames(folders: Iterable[Path], split: str = "test") -> list[Frame]:
    """Return the frames below ``{split}*`` of a dataset's folders, in order of scene and image."""
    frames: dict[tuple[int, int], Frame] = {}
    folders = list(folders)
    for path in scene_files(folders, split):
        folder = path.parent
        with refusing(folder, "the name of a scene's folder is not a number", "name it like 000001"):
            scene = whole(folder.name)
        cameras, truths = (read_images(folder / f"scene_{name}.json") for name in ("camera", "gt"))
        colors = folder / ("rgb" if (folder / "rgb").is_dir() else "gray")
        for image, truth in truths.items():
            if image not in cameras:
                raise InputError(folder / "scene_camera.json", f"has no image {image}", REMEDY)
            if not isinstance(truth, list):
                raise InputError(folder / "scene_gt.json", f"image {image} has no list of objects", REMEDY)
            camera = read_camera(cameras[image], f"{folder / 'scene_camera.json'}: image {image}")
            depth, color = _needed_image(folder / "depth", f"{image:06d}"), _image(colors, f"{image:06d}")
            annotations = []
            for n, entry in enumerate(truth):
                subject = f"{folder / 'scene_gt.json'}: image {image}, object {n}"
                pose = read_pose(entry, subject)
                mask = _needed_image(folder / "mask_visib", f"{image:06d}_{n:06d}")
                annotations.append(Annotation(*pose, mask, subject))
            frame = Frame(scene, image, *camera, depth, color, tuple(annotations))
            if (same := frames.setdefault(frame.place, frame)) is not frame:
                both = f"{same.depth} and {frame.depth}"
                raise InputError(both, "are the same image of the same scene", "set split to the intended folder")
    if not frames:
        raise InputError(", ".join(map(str, folders)), "lists no image", REMEDY)
    return sorted(frames.values(), key=lambda frame: frame.place)


def measured_points(frame: Frame, annotation: Annotation, depth_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the points (P, 3) measured within an object's mask, and their pixels (P, 2); TooFewPoints for few."""
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
    """Return the points within a diameter of their median, and their pixels: a mask's rim shows some background."""
    near = np.linalg.norm(points - np.median(points, axis=0), axis=1) <= diameter_m
    _require_points(points[near], annotation)
    return points[near], pixels[near]


def _require_points(points: np.ndarray, annotation: Annotation) -> None:
    if len(points) < FEWEST_POINTS:
        remedy = f"leave it out: at least {FEWEST_POINTS} are needed"
        raise TooFewPoints(annotation.mask, f"has depth at {len(points)} pixel(s)", remedy)


class TooFewPoints(InputError):
    """Hardly any points were measured on an object; a reader may skip it."""


def _image(folder: Path, stem: str) -> Path | None:
    files = (folder / f"{stem}{suffix}" for suffix in (".png", ".jpg", ".jpeg", ".tif"))
    return next((path for path in files if path.is_file()), None)


def _needed_image(folder: Path, stem: str) -> Path:
    if (path := _image(folder, stem)) is None:
        raise InputError(folder / f"{stem}.png", "no such image", REMEDY)
    return path
